// What Mesa keeps until the program ends is not ours to free: suppressions for the leak sanitizer.
#pragma once

namespace penalty::test {

inline constexpr const char* leaks_of_mesa = "leak:libOSMesa.so\nleak:libEGL\nleak:libgallium\nleak:swrast\n";

}  // namespace penalty::test
