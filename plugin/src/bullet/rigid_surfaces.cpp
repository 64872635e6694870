#include "rigid_surfaces.h"

#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <limits>

#include "convert.h"
#include "held_bodies.h"
#include "surfaces.h"

namespace penalty {
namespace {

constexpr Real stretch = 1.5;        // of edges that is reckoned with
constexpr Real negligible = 0.05;    // share of the margin that a ball may sink in between nodes
constexpr Real least_margin = 0.01;  // share of the mean edge: surfaces keep that much in any case
constexpr Real padding_share = 0.5;  // of the size of a box, that is searched about it for triangles

// A large ball sinks no deeper in between the nodes than l² / 6R, l the longest edge: the nodes do.
bool are_needed(const ShapeEdges& edges, const ContactSurface& soft) {
  const Real edge = stretch * soft.longest_edge();
  return edge * edge > negligible * soft.margin * 6 * (edges.radius + soft.margin);
}

}  // namespace

void RigidSurfaces::begin_step() {
  const auto is_old = [this](const auto& entry) { return entry.second.used < step_; };
  std::erase_if(pairs_, is_old);
  std::erase_if(objects_, is_old);
  ++step_;
}

// Each body knows its own part of a concave object.
RigidSurfaces::Object& RigidSurfaces::refreshed(const HeldBody& held, const btCollisionObject& object, const Box& box) {
  const btCollisionShape& shape = *object.getCollisionShape();
  const bool is_of_triangles = is_concave(shape);
  Object& known = objects_[{is_of_triangles ? held.order : 0, object.getBroadphaseHandle()->m_uniqueId}];
  if (known.used != step_) known.margin = std::numeric_limits<Real>::infinity();
  known.used = step_;
  const bool is_covered =
      !is_of_triangles || (known.covered.contains(box.low, 0) && known.covered.contains(box.high, 0));
  if (is_covered && fingerprint_of(shape, known.covered) == known.fingerprint) return known;
  const Vector3 padding = padding_share * (box.high - box.low);
  known.covered = {box.low - padding, box.high + padding};
  known.fingerprint = fingerprint_of(shape, known.covered);
  known.edges = edges_of(shape, known.covered);
  known.surfaces.clear();
  for (const ShapeEdges& edges : known.edges)
    known.surfaces.push_back(std::make_shared<ContactSurface>(edges.points, edges.edges, edges.radius));
  return known;
}

std::vector<SurfacePair*> RigidSurfaces::near(HeldBody& held, const btCollisionObject& object, const Box& box) {
  std::vector<SurfacePair*> found;
  const ContactSurface& soft = surface_of(held);
  if (soft.edges().empty()) return found;
  const Matrix3 to_object = to_matrix(object.getWorldTransform().getBasis()).transpose();
  const Box local = transformed(box, to_object, -(to_object * to_vector(object.getWorldTransform().getOrigin())));
  Object& known = refreshed(held, object, local);
  known.margin = std::min(known.margin, std::max(soft.margin, least_margin * soft.mean_edge()));
  for (std::size_t k = 0; k < known.edges.size(); ++k) {
    if (!known.edges[k].reach_into(local) || !are_needed(known.edges[k], soft)) continue;
    const std::shared_ptr<ContactSurface>& rigid = known.surfaces[k];
    rigid->margin = known.margin;
    rigid->friction = object.getFriction();
    Pair& pair = pairs_[{held.order, static_cast<std::uint64_t>(object.getBroadphaseHandle()->m_uniqueId), k}];
    pair.used = step_;
    if (pair.soft != held.surface || pair.rigid != rigid)
      pair = {held.surface, rigid, std::make_unique<SurfacePair>(*held.surface, *rigid), step_};
    found.push_back(pair.pair.get());
  }
  return found;
}

}  // namespace penalty
