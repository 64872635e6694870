// What most tests include, read once by the compiler. No source may rely on it: builds with ccache go without.
#include <gtest/gtest.h>

#include "penalty/assembly/potential_field.h"
#include "penalty/mesh/builders.h"
