// A body-centred cubic lattice: tetrahedra of one shape that fill space.
#pragma once
#include <array>
#include <cstdint>

#include "penalty/fields/topology.h"
#include "penalty/math/types.h"

namespace penalty {

/// Cubic cells with a vertex at each corner and each centre. Around the line between the centres of two neighbouring
/// cells lie four tetrahedra, one for each side of the face between the cells:
///
///        e2                 c, d    centres of the cells on either side of the face, 1 cell apart
///       /| \                e1, e2  ends of one side of the face
///      / |   \              |e1 e2| = 1 cell, |c e1| = sqrt(3)/2 cells
///     c -+--- d
///      \ |   /
///        e1
///
/// Seen from its cell, a point belongs to the tetrahedron that the greatest of its distances to the centre, |x|, |y|,
/// |z|, and the second greatest, each with its sign, name: the face, and the side of the face.
class BccLattice {
 public:
  using Cell = std::array<int, 3>;
  using Id = std::int32_t;  // of a tetrahedron or of a vertex, dense from 0

  /// Covers the box from `low` to `high` [m] with cells of edge `size` [m], and one more cell all round.
  BccLattice(const Vector3& low, const Vector3& high, Real size);

  const Cell& cells() const { return cells_; }            // along each direction
  Id num_tetrahedra() const { return 12 * num_cells(); }  // some at the rim do not exist
  Id num_vertices() const { return 2 * num_corners(); }   // centres take even numbers where corners take odd ones

  bool exists(Id tetrahedron) const;
  Cell cell_at(const Vector3& point) const;  // clamped into the lattice
  Id tetrahedron_at(const Vector3& point) const;
  Vector3 in_cells(const Vector3& point) const { return (point - origin_) / size_; }  // cell i reaches from i to i + 1

  /// Each cell owns the tetrahedra on its faces towards higher x, y, z: `part` 0 to 11.
  Id tetrahedron(const Cell& cell, int part) const { return 12 * cell_id(cell) + part; }
  /// Their corners, seen from the lowest corner of the cell, 1 = one cell.
  static const std::array<Points<4>, 12>& shapes();

  Tetrahedron vertices_of(Id tetrahedron) const;       // positively oriented
  std::array<Id, 4> neighbours(Id tetrahedron) const;  // across its faces; -1 beyond the rim
  Vector3 position(Id vertex) const;
  Points<4> points_of(Id tetrahedron) const;

 private:
  // A face of a cell, by axis and sign, and a side of the face.
  struct Side {
    Cell cell;
    int face_axis, face_sign, side_axis, side_sign;
  };
  Side side_of(Id tetrahedron) const;
  static Side side_of_part(const Cell& cell, int part);
  Id id_of(Side side) const;  // -1 if there is no such tetrahedron

  Id num_cells() const { return cells_[0] * cells_[1] * cells_[2]; }
  Id num_corners() const { return (cells_[0] + 1) * (cells_[1] + 1) * (cells_[2] + 1); }
  bool contains(const Cell& cell) const;
  Id cell_id(const Cell& cell) const;
  Id centre(const Cell& cell) const;
  Id corner(const Cell& cell) const;  // the lowest one

  Vector3 origin_;
  Real size_;
  Cell cells_;
  std::array<int, 3> slowest_first_;  // directions by number of cells, greatest first
};

}  // namespace penalty
