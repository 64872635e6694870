// What the builders say about their arguments.
#pragma once
#include <stdexcept>
#include <string>
#include <vector>

#include "mesh_text.h"
#include "penalty/mesh/tet_mesh.h"

namespace penalty {

inline void require_length(Real value, const std::string& name) {
  if (!(value > 0) || value > largest_coordinate)
    throw std::invalid_argument(name + " is " + to_text(value) + ", not a positive finite length");
}

inline void require_count(int value, int least, int most, const std::string& name) {
  if (value < least || value > most)
    throw std::invalid_argument(name + " is " + std::to_string(value) + ", not between " + std::to_string(least) +
                                " and " + std::to_string(most));
}

inline std::string call(const std::string& name, const std::vector<std::string>& arguments) {
  std::string text = name + "(";
  for (const std::string& argument : arguments) text += (text.back() == '(' ? "" : ", ") + argument;
  return text + ")";
}

}  // namespace penalty
