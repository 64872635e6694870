#include "surface_distance.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "convert.h"

namespace penalty {
namespace {

// From the nearest point of a core (a centre or a segment) that the surface surrounds at `radius`.
SurfacePoint around_core(const Vector3& point, const Vector3& core, Real radius) {
  const Vector3 offset = point - core;
  const Real distance = offset.norm();
  const Vector3 normal = distance > 0 ? Vector3(offset / distance) : Vector3(Vector3::UnitY());
  return {core + radius * normal, normal, distance - radius, radius};
}

SurfacePoint box_surface_point(const btBoxShape& box, const Vector3& point) {
  const Vector3 half = to_vector(box.getHalfExtentsWithMargin());
  const Vector3 inside = point.cwiseMax(-half).cwiseMin(half);
  const Vector3 offset = point - inside;
  const Real distance = offset.norm();
  if (distance > 0) return {inside, offset / distance, distance};
  int axis = 0;
  const Real depth = (half - point.cwiseAbs()).minCoeff(&axis);
  Vector3 normal = Vector3::Zero();
  normal[axis] = point[axis] < 0 ? -1 : 1;
  return {point + depth * normal, normal, -depth};
}

SurfacePoint capsule_surface_point(const btCapsuleShape& capsule, const Vector3& point) {
  Vector3 core = Vector3::Zero();
  const Real half = capsule.getHalfHeight();
  const int axis = capsule.getUpAxis();
  core[axis] = std::clamp(point[axis], -half, half);
  return around_core(point, core, capsule.getRadius());
}

SurfacePoint plane_surface_point(const btStaticPlaneShape& plane, const Vector3& point) {
  const Vector3 normal = to_vector(plane.getPlaneNormal());
  const Real distance = normal.dot(point) - Real(plane.getPlaneConstant());
  return {point - distance * normal, normal, distance};
}

std::optional<SurfacePoint> convex_surface_point(const btConvexShape& convex, const Vector3& point) {
  if (convex.getShapeType() == CONVEX_HULL_SHAPE_PROXYTYPE &&
      static_cast<const btConvexHullShape&>(convex).getNumPoints() == 0)
    return std::nullopt;  // which Bullet would follow into nowhere
  btGjkEpaSolver2::sResults results;
  const Real distance =
      btGjkEpaSolver2::SignedDistance(to_bullet(point), 0, &convex, btTransform::getIdentity(), results);
  if (!(distance < SIMD_INFINITY)) return std::nullopt;
  const Vector3 normal = to_vector(results.normal);
  if (!(std::abs(normal.squaredNorm() - 1) < 1e-3)) return std::nullopt;
  return SurfacePoint{point - distance * normal, normal, distance};
}

void append_compound(const btCompoundShape& compound, const Vector3& point, Real reach,
                     std::vector<SurfacePoint>& found) {
  for (int child = 0; child < compound.getNumChildShapes(); ++child) {
    const btTransform& transform = compound.getChildTransform(child);
    const Matrix3 rotation = to_matrix(transform.getBasis());
    const Vector3 origin = to_vector(transform.getOrigin());
    const std::size_t begin = found.size();
    append_surface_points(*compound.getChildShape(child), rotation.transpose() * (point - origin), reach, found);
    for (std::size_t i = begin; i < found.size(); ++i) {
      found[i].point = rotation * found[i].point + origin;
      found[i].normal = rotation * found[i].normal;
    }
  }
}

}  // namespace

void append_surface_points(const btCollisionShape& shape, const Vector3& point, Real reach,
                           std::vector<SurfacePoint>& found) {
  std::optional<SurfacePoint> nearest;
  switch (shape.getShapeType()) {
    case STATIC_PLANE_PROXYTYPE:
      nearest = plane_surface_point(static_cast<const btStaticPlaneShape&>(shape), point);
      break;
    case SPHERE_SHAPE_PROXYTYPE:
      nearest = around_core(point, Vector3::Zero(), static_cast<const btSphereShape&>(shape).getRadius());
      break;
    case BOX_SHAPE_PROXYTYPE:
      nearest = box_surface_point(static_cast<const btBoxShape&>(shape), point);
      break;
    case CAPSULE_SHAPE_PROXYTYPE:
      nearest = capsule_surface_point(static_cast<const btCapsuleShape&>(shape), point);
      break;
    default:
      if (shape.isCompound()) {
        append_compound(static_cast<const btCompoundShape&>(shape), point, reach, found);
      } else if (shape.isConvex()) {
        nearest = convex_surface_point(static_cast<const btConvexShape&>(shape), point);
      }
  }
  if (nearest && nearest->distance < reach) found.push_back(*nearest);
}

}  // namespace penalty
