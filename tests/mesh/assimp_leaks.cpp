// Assimp loses memory when it gives up on a broken file; the leak checker is told, by name, that this is not ours. One
// of the sources of every program that reads broken surfaces: of a library nobody would take it.
extern "C" const char* __lsan_default_suppressions();                                // NOLINT: the checker's name
extern "C" const char* __lsan_default_suppressions() { return "leak:libassimp\n"; }  // NOLINT
