#include "render/leaks_of_mesa.h"

// The leak sanitizer asks for this by name.
extern "C" const char* __lsan_default_suppressions();  // NOLINT: the sanitizer's name
extern "C" const char* __lsan_default_suppressions() { return penalty::test::leaks_of_mesa; }  // NOLINT
