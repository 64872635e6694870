// Faces of a soft body that tears.
#pragma once
#include <array>
#include <vector>

#include "penalty/fields/broken_elements.h"

class btSoftBody;

namespace penalty {

/// Tetrahedra of the body, or, of one that has none, those that the field is made of: of positive volume at rest.
std::vector<Tetrahedron> tetrahedra_of(const btSoftBody& body, const PotentialField& field);

/// Faces go with the elements that hold them: those that what broke cuts, and those of tetrahedra that it cuts. A torn face
/// keeps its number, but all its corners are its first node: rays pass, nothing of it is drawn, no air pushes it. It is whole
/// again when its elements are. The faces behind tetrahedra that went are appended; they look out of what is left.
class TornFaces {
 public:
  struct Torn {
    int face;
    std::array<int, 3> corners;  // nodes that it had
  };

  /// Returns whether faces changed.
  bool update(btSoftBody& body, const PotentialField& field);

  /// Makes all faces whole and removes those that were appended, unless others appended some after them.
  /// Returns whether faces changed.
  bool give_back(btSoftBody& body);

  const std::vector<Torn>& torn() const { return torn_; }

  /// Whether the body has faces but for those that were appended here.
  bool has_own(const btSoftBody& body) const;

 private:
  std::vector<Torn> torn_;
  int own_size_ = 0, size_ = 0;  // faces that the body has without those that were appended here, and with them
  BreakCount count_;             // at which they were
};

}  // namespace penalty
