#include "penalty/math/types.h"

namespace penalty::detail {

template <>
const char OwnEigenFlags::same_as_in_the_library = 0;

}  // namespace penalty::detail
