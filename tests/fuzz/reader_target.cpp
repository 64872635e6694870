// One reader under libFuzzer: PENALTY_FUZZ_FORMAT says which. A Finding ends the program, and the input is kept.
#include <cstdint>

#include "fuzz/readers.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace penalty::testing;
  static const ReaderCheck reader(format_of(PENALTY_FUZZ_FORMAT));
  reader.read({reinterpret_cast<const char*>(data), size});
  return 0;
}
