// Faces of a soft body that tears.
#pragma once
#include <array>
#include <vector>

#include "penalty/fields/broken_elements.h"

class btSoftBody;

namespace penalty {

/// Faces go with the elements that hold them: those that what broke cuts, and those of tetrahedra that it cuts. A torn face
/// keeps its number, but all its corners are its first node: rays pass, nothing of it is drawn, no air pushes it. It is whole
/// again when its elements are. The faces behind tetrahedra that went are appended.
class TornFaces {
 public:
  struct Torn {
    int face;
    std::array<int, 3> corners;  // nodes that it had
  };

  /// Returns whether faces changed.
  bool update(btSoftBody& body, const PotentialField& field);

  const std::vector<Torn>& torn() const { return torn_; }

 private:
  std::vector<Torn> torn_;
  BreakCount count_;  // at which they were
};

}  // namespace penalty
