#include "torn_faces.h"

#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <map>
#include <set>

#include "convert.h"
#include "nodes.h"
#include "penalty/fields/batch.h"
#include "penalty/kinds/stable_neo_hookean.h"
#include "penalty/kinds/tetrahedron_volume.h"

namespace penalty {
namespace {

using Node = btSoftBody::Node;

template <std::size_t N>
std::array<int, N> numbers_of(const btSoftBody& body, Node* const (&nodes)[N]) {
  std::array<int, N> numbers;
  for (std::size_t k = 0; k < N; ++k) numbers[k] = index_of(body, nodes[k]);
  return numbers;
}

template <std::size_t N>
std::array<int, N> sorted(std::array<int, N> numbers) {
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

// By their sorted corners.
std::map<Triangle, Triangle> by_corners(const std::vector<Triangle>& triangles) {
  std::map<Triangle, Triangle> sorted_ones;
  for (const Triangle& t : triangles) sorted_ones.emplace(sorted(t), t);
  return sorted_ones;
}

void set_corners(btSoftBody& body, int face, const Triangle& corners) {
  for (int k = 0; k < 3; ++k) body.m_faces[face].m_n[k] = &body.m_nodes[corners[k]];
}

void append_face(btSoftBody& body, const Triangle& corners, const PackedVectors& rest) {
  btSoftBody::Face face;
  face.m_tag = nullptr;
  face.m_material = body.m_faces.size() > 0 ? body.m_faces[0].m_material : body.m_materials[0];
  for (int k = 0; k < 3; ++k) face.m_n[k] = &body.m_nodes[corners[k]];
  const Vector3 a = rest.col(corners[0]).head<3>(), b = rest.col(corners[1]).head<3>(),
                c = rest.col(corners[2]).head<3>();
  face.m_ra = static_cast<btScalar>((b - a).cross(c - a).norm());  // as Bullet has it: without the half
  const btVector3 normal = btCross(face.m_n[1]->m_x - face.m_n[0]->m_x, face.m_n[2]->m_x - face.m_n[0]->m_x);
  face.m_normal = normal.fuzzyZero() ? btVector3(0, 0, 0) : normal.normalized();
  face.m_leaf = nullptr;
  face.m_pcontact = btVector4(0, 0, 0, 0);
  face.m_n0 = face.m_n1 = face.m_vn = btVector3(0, 0, 0);
  face.m_index = body.m_faces.size();
  body.m_faces.push_back(face);
}

}  // namespace

std::vector<Tetrahedron> tetrahedra_of(const btSoftBody& body, const PotentialField& field) {
  std::vector<Tetrahedron> tetrahedra;
  tetrahedra.reserve(body.m_tetras.size());
  for (int k = 0; k < body.m_tetras.size(); ++k) {
    const Tetrahedron t = numbers_of(body, body.m_tetras[k].m_n);
    if (std::all_of(t.begin(), t.end(), [](int node) { return node >= 0; })) tetrahedra.push_back(t);
  }
  const bool has_own = !tetrahedra.empty();
  std::set<Tetrahedron> known;
  const auto add = [&](const auto* batch) {
    if (!batch) return;
    for (const Tetrahedron& t : batch->stencils())
      if (known.insert(sorted(t)).second) tetrahedra.push_back(t);
  };
  for (const auto& potential : field.potentials()) {
    if (has_own) break;
    add(dynamic_cast<const Batch<TetrahedronVolume>*>(potential.get()));
    add(dynamic_cast<const Batch<StableNeoHookean>*>(potential.get()));
  }
  orient(field.rest_positions().topRows<3>(), tetrahedra);
  return tetrahedra;
}

bool TornFaces::update(btSoftBody& body, const PotentialField& field) {
  const BreakCount count = count_breaks(field);
  if (count == count_) return false;
  const BrokenElements broken(field);
  const std::vector<Tetrahedron> tetrahedra = tetrahedra_of(body, field);
  std::vector<Tetrahedron> whole;
  for (const Tetrahedron& t : tetrahedra)
    if (!broken.cut(t)) whole.push_back(t);
  const std::vector<Triangle> all = faces_of(tetrahedra);
  const std::map<Triangle, Triangle> bare = by_corners(boundary_faces(whole)),
                                     skin = by_corners(boundary_faces(tetrahedra));

  const int size = body.m_faces.size();
  std::erase_if(torn_, [size](const Torn& t) { return t.face >= size; });  // others may have changed them
  if (size != size_) own_size_ = size;
  std::vector<Triangle> faces;  // of the body, when nothing is torn
  faces.reserve(size);
  for (int k = 0; k < size; ++k) faces.push_back(numbers_of(body, body.m_faces[k].m_n));
  for (const auto& [face, corners] : torn_) faces[face] = corners;
  std::vector<Torn> torn;
  for (int k = 0; k < size; ++k) {
    const Triangle key = sorted(faces[k]);
    const bool is_of_tetrahedron = std::binary_search(all.begin(), all.end(), key);
    const auto found = bare.find(key);
    if (is_of_tetrahedron ? found == bare.end() : broken.cut(faces[k]))
      torn.push_back({k, faces[k]});
    else if (is_of_tetrahedron && k >= own_size_)
      faces[k] = found->second;  // the other of its two tetrahedra may be the one that is left
  }
  const std::map<Triangle, Triangle> known = by_corners(faces);

  for (int k = 0; k < size; ++k) set_corners(body, k, faces[k]);
  for (const auto& [face, corners] : torn) set_corners(body, face, {corners[0], corners[0], corners[0]});
  for (const auto& [key, face] : bare)
    if (!known.contains(key) && !skin.contains(key)) append_face(body, face, field.rest_positions());
  size_ = body.m_faces.size();
  torn_ = std::move(torn);
  count_ = count;
  return true;
}

bool TornFaces::give_back(btSoftBody& body) {
  const bool appended = body.m_faces.size() == size_ && size_ > own_size_;
  if (torn_.empty() && !appended) return false;
  for (const auto& [face, corners] : torn_)
    if (face < body.m_faces.size()) set_corners(body, face, corners);
  while (appended && body.m_faces.size() > own_size_) body.m_faces.pop_back();
  *this = {};
  return true;
}

bool TornFaces::has_own(const btSoftBody& body) const {
  return (body.m_faces.size() == size_ ? own_size_ : body.m_faces.size()) > 0;
}

}  // namespace penalty
