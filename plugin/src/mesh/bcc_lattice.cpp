#include "bcc_lattice.h"

#include <algorithm>
#include <cmath>

namespace penalty {

BccLattice::BccLattice(const Vector3& low, const Vector3& high, Real size) : size_(size), slowest_first_{0, 1, 2} {
  for (int axis = 0; axis < 3; ++axis) {
    const int inner = std::max(1, static_cast<int>(std::ceil((high[axis] - low[axis]) / size * (1 - 1e-12))));
    cells_[axis] = inner + 2;
    origin_[axis] = (low[axis] + high[axis]) / 2 - size * cells_[axis] / 2;
  }
  std::stable_sort(slowest_first_.begin(), slowest_first_.end(),
                   [this](int l, int r) { return cells_[l] > cells_[r]; });
}

bool BccLattice::contains(const Cell& cell) const {
  for (int axis = 0; axis < 3; ++axis)
    if (cell[axis] < 0 || cell[axis] >= cells_[axis]) return false;
  return true;
}

BccLattice::Id BccLattice::cell_id(const Cell& cell) const {
  const auto [a, b, c] = slowest_first_;
  return (cell[a] * cells_[b] + cell[b]) * cells_[c] + cell[c];
}

BccLattice::Id BccLattice::corner(const Cell& cell) const {
  const auto [a, b, c] = slowest_first_;
  return 2 * ((cell[a] * (cells_[b] + 1) + cell[b]) * (cells_[c] + 1) + cell[c]) + 1;
}

// Between the corners of its cell, so that numbering by id walks through both kinds together.
BccLattice::Id BccLattice::centre(const Cell& cell) const { return corner(cell) - 1; }

BccLattice::Side BccLattice::side_of_part(const Cell& cell, int part) {
  const int face_axis = part / 4, other = part / 2 % 2;
  return {cell, face_axis, 1, (face_axis + 1 + other) % 3, part % 2 == 0 ? -1 : 1};
}

BccLattice::Side BccLattice::side_of(Id tetrahedron) const {
  const auto [a, b, c] = slowest_first_;
  const Id cell_number = tetrahedron / 12;
  Cell cell;
  cell[c] = cell_number % cells_[c];
  cell[b] = cell_number / cells_[c] % cells_[b];
  cell[a] = cell_number / cells_[c] / cells_[b];
  return side_of_part(cell, tetrahedron % 12);
}

const std::array<Points<4>, 12>& BccLattice::shapes() {
  static const std::array<Points<4>, 12> shapes = [] {
    std::array<Points<4>, 12> parts;
    for (int part = 0; part < 12; ++part) {
      const Side side = side_of_part({0, 0, 0}, part);
      Vector3 along = Vector3::Zero(), aside = Vector3::Zero(), across = Vector3::Zero();
      along[side.face_axis] = 0.5;
      aside[side.side_axis] = 0.5 * side.side_sign;
      across[3 - side.face_axis - side.side_axis] = 0.5;
      const Vector3 centre = Vector3::Constant(0.5);
      parts[part] << centre, centre + 2 * along, centre + along + aside - across, centre + along + aside + across;
    }
    return parts;
  }();
  return shapes;
}

BccLattice::Id BccLattice::id_of(Side side) const {
  if (side.face_sign < 0) --side.cell[side.face_axis];
  Cell next = side.cell;
  ++next[side.face_axis];
  if (!contains(side.cell) || !contains(next)) return -1;
  const int other = (side.side_axis - side.face_axis + 3) % 3 - 1;
  return 12 * cell_id(side.cell) + 4 * side.face_axis + 2 * other + (side.side_sign > 0 ? 1 : 0);
}

bool BccLattice::exists(Id tetrahedron) const { return id_of(side_of(tetrahedron)) >= 0; }

BccLattice::Cell BccLattice::cell_at(const Vector3& point) const {
  Cell cell;
  for (int axis = 0; axis < 3; ++axis)
    cell[axis] = std::clamp(static_cast<int>(std::floor(in_cells(point)[axis])), 0, cells_[axis] - 1);
  return cell;
}

BccLattice::Id BccLattice::tetrahedron_at(const Vector3& point) const {
  Side side;
  side.cell = cell_at(point);
  Vector3 offset = in_cells(point);
  for (int axis = 0; axis < 3; ++axis) offset[axis] -= side.cell[axis] + 0.5;
  std::array<int, 3> order{0, 1, 2};
  std::stable_sort(order.begin(), order.end(), [&](int l, int r) { return std::abs(offset[l]) > std::abs(offset[r]); });
  side.face_axis = order[0];
  side.face_sign = offset[order[0]] < 0 ? -1 : 1;
  side.side_axis = order[1];
  side.side_sign = offset[order[1]] < 0 ? -1 : 1;
  return id_of(side);
}

Tetrahedron BccLattice::vertices_of(Id tetrahedron) const {
  const Side side = side_of(tetrahedron);
  Cell next = side.cell;
  ++next[side.face_axis];
  Cell low = next;  // lowest corner of the face, moved to the lower end of the side
  if (side.side_sign > 0) ++low[side.side_axis];
  Cell high = low;
  ++high[3 - side.face_axis - side.side_axis];
  const Id c = centre(side.cell), d = centre(next), e1 = corner(low), e2 = corner(high);
  // (d - c) . ((e1 - c) x (e2 - c)) has the sign of face x side x third direction, mirrored with the side.
  const bool cyclic = (side.side_axis - side.face_axis + 3) % 3 == 1;
  return cyclic == (side.side_sign > 0) ? Tetrahedron{c, d, e1, e2} : Tetrahedron{c, d, e2, e1};
}

std::array<BccLattice::Id, 4> BccLattice::neighbours(Id tetrahedron) const {
  const Side here = side_of(tetrahedron);
  const int third_axis = 3 - here.face_axis - here.side_axis;
  Side across = here;  // round the line between the centres
  across.side_axis = third_axis;
  across.side_sign = -1;
  const Id before = id_of(across);
  across.side_sign = 1;
  const Id after = id_of(across);
  // Within either cell the face on the far side of e1 e2 swaps its part with the side.
  const Side in_cell{here.cell, here.side_axis, here.side_sign, here.face_axis, 1};
  Side in_next = in_cell;
  ++in_next.cell[here.face_axis];
  in_next.side_sign = -1;
  return {before, after, id_of(in_cell), id_of(in_next)};
}

Vector3 BccLattice::position(Id vertex) const {
  const auto [a, b, c] = slowest_first_;
  const Id number = vertex / 2;
  const Real half = vertex % 2 == 0 ? 0.5 : 0;
  Vector3 place;
  const Id row = number / (cells_[c] + 1), layer = row / (cells_[b] + 1);
  place[c] = static_cast<Real>(number % (cells_[c] + 1));
  place[b] = static_cast<Real>(row % (cells_[b] + 1));
  place[a] = static_cast<Real>(layer);
  return origin_ + size_ * (place.array() + half).matrix();
}

Points<4> BccLattice::points_of(Id tetrahedron) const {
  const Tetrahedron vertices = vertices_of(tetrahedron);
  Points<4> points;
  for (int k = 0; k < 4; ++k) points.col(k) = position(vertices[k]);
  return points;
}

}  // namespace penalty
