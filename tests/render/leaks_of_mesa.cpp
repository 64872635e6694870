// The leak sanitizer asks for this by name: what Mesa keeps until the program ends is not ours to free.
extern "C" const char* __lsan_default_suppressions();  // NOLINT: the sanitizer's name
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libOSMesa.so\nleak:libEGL\nleak:libgallium\nleak:swrast\n";
}
