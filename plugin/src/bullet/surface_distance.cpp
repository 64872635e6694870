#include "surface_distance.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/CollisionShapes/btTriangleCallback.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>

#include <algorithm>
#include <cmath>
#include <limits>
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
  btGjkEpaSolver2::sResults results;
  const Real distance =
      btGjkEpaSolver2::SignedDistance(to_bullet(point), 0, &convex, btTransform::getIdentity(), results);
  if (!(distance < SIMD_INFINITY)) return std::nullopt;
  const Vector3 normal = to_vector(results.normal);
  if (!(std::abs(normal.squaredNorm() - 1) < 1e-3)) return std::nullopt;
  return SurfacePoint{point - distance * normal, normal, distance};
}

// The point of a triangle nearest to `p` (Ericson, Real-Time Collision Detection, section 5.1.5).
Vector3 nearest_on_triangle(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 ab = b - a, ac = c - a, ap = p - a;
  const Real d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vector3 bp = p - b;
  const Real d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const Real vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  const Vector3 cp = p - c;
  const Real d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const Real vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  const Real va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  return a + (vb * ab + vc * ac) / (va + vb + vc);
}

constexpr Real same_distance = 1e-9;

class NearestTriangle final : public btTriangleCallback {
 public:
  NearestTriangle(const Vector3& point, Real margin) : point_(point), margin_(margin) {}

  void processTriangle(btVector3* triangle, int, int) override {
    const Vector3 a = to_vector(triangle[0]), b = to_vector(triangle[1]), c = to_vector(triangle[2]);
    Vector3 face = (b - a).cross(c - a);
    const Real twice_area = face.norm();
    if (!(twice_area > 0)) return;
    face /= twice_area;
    const Vector3 nearest = nearest_on_triangle(point_, a, b, c);
    const Real distance = (point_ - nearest).norm();
    // Triangles that share the nearest edge or vertex are equally near: the one that faces the point most squarely
    // knows its side, also where they meet at a sharp angle.
    const Real height = (point_ - nearest).dot(face);
    const Real tie = same_distance * (distance + std::sqrt(twice_area));
    if (distance > nearest_ + tie || (distance > nearest_ - tie && std::abs(height) <= height_)) return;
    nearest_ = distance;
    height_ = std::abs(height);
    const bool in_front = height > 0;
    const Vector3 normal = in_front ? Vector3((point_ - nearest) / distance) : face;
    found = SurfacePoint{nearest + margin_ * normal, normal, (in_front ? distance : -distance) - margin_};
  }

  std::optional<SurfacePoint> found;

 private:
  Vector3 point_;
  Real margin_, nearest_ = std::numeric_limits<Real>::infinity();
  Real height_ = -1;  // above the plane of the nearest triangle, either side
};

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
      } else if (shape.isConcave()) {
        NearestTriangle callback(point, shape.getMargin());
        const btVector3 extent = to_bullet(Vector3(Vector3::Constant(reach)));
        static_cast<const btConcaveShape&>(shape).processAllTriangles(&callback, to_bullet(point) - extent,
                                                                      to_bullet(point) + extent);
        nearest = callback.found;
      } else if (shape.isConvex()) {
        nearest = convex_surface_point(static_cast<const btConvexShape&>(shape), point);
      }
  }
  if (nearest && nearest->distance < reach) found.push_back(*nearest);
}

}  // namespace penalty
