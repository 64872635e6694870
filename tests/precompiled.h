// What all tests include, read once by the compiler. No source may rely on it: builds with ccache go without.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <random>
#include <set>
#include <sstream>

#include "penalty/math/types.h"
