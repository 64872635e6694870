#include "shape_edges.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btMultiSphereShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btTriangleCallback.h>
#include <LinearMath/btConvexHullComputer.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <tuple>

#include "convert.h"

namespace penalty {
namespace {

constexpr int rim_sides = 24;     // of the polygon that stands for a circle
constexpr int directions = 128;   // in which a convex shape of another kind is asked for its corners
constexpr Real flat_edge = 1e-4;  // sine of the angle between triangles whose edge is none
using List = std::vector<ShapeEdges>;

ShapeEdges& of_radius(List& list, Real radius) {
  const auto known = std::find_if(list.begin(), list.end(), [&](const ShapeEdges& e) { return e.radius == radius; });
  return known != list.end() ? *known : list.emplace_back(ShapeEdges{.radius = radius});
}

int add_point(ShapeEdges& to, const Vector3& point) {
  to.points.push_back(point);
  return static_cast<int>(to.points.size()) - 1;
}

void add_ball(List& list, const Vector3& center, Real radius) {
  ShapeEdges& to = of_radius(list, radius);
  const int point = add_point(to, center);
  to.edges.push_back({point, point});
}

void add_segment(List& list, const Vector3& from, const Vector3& to, Real radius) {
  ShapeEdges& edges = of_radius(list, radius);
  const int first = add_point(edges, from), second = add_point(edges, to);
  edges.edges.push_back({first, second});
}

void add_box(List& list, const Vector3& half) {
  ShapeEdges& to = of_radius(list, 0);
  const auto first = static_cast<int>(to.points.size());
  for (int k = 0; k < 8; ++k)
    add_point(to, half.cwiseProduct(Vector3((k & 1) ? 1 : -1, (k & 2) ? 1 : -1, (k & 4) ? 1 : -1)));
  for (int k = 0; k < 8; ++k)
    for (const int axis : {1, 2, 4})
      if ((k & axis) == 0) to.edges.push_back({first + k, first + (k | axis)});
}

// A circle about `axis`.
std::vector<int> add_rim(ShapeEdges& to, int axis, Real height, Real radius) {
  std::vector<int> rim;
  for (int k = 0; k < rim_sides; ++k) {
    const Real angle = 2 * std::numbers::pi * k / rim_sides;
    Vector3 point;
    point[axis] = height;
    point[(axis + 1) % 3] = radius * std::cos(angle);
    point[(axis + 2) % 3] = radius * std::sin(angle);
    rim.push_back(add_point(to, point));
  }
  for (int k = 0; k < rim_sides; ++k) to.edges.push_back({rim[k], rim[(k + 1) % rim_sides]});
  return rim;
}

void add_cylinder(List& list, const btCylinderShape& cylinder) {
  ShapeEdges& to = of_radius(list, 0);
  const int axis = cylinder.getUpAxis();
  const Real height = cylinder.getHalfExtentsWithMargin()[axis], radius = cylinder.getRadius();
  const std::vector<int> low = add_rim(to, axis, -height, radius), high = add_rim(to, axis, height, radius);
  for (int k = 0; k < rim_sides; ++k) to.edges.push_back({low[k], high[k]});
}

void add_cone(List& list, const btConeShape& cone) {
  ShapeEdges& to = of_radius(list, cone.getMargin());
  const int axis = cone.getConeUpIndex();
  const Real height = Real(cone.getHeight()) / 2;
  const int apex = add_point(to, height * Vector3::Unit(axis));
  for (const int k : add_rim(to, axis, -height, cone.getRadius())) to.edges.push_back({apex, k});
}

void add_balls(List& list, const btMultiSphereShape& balls) {
  const Vector3 scale = to_vector(balls.getLocalScaling());
  std::vector<Vector3> centers;
  std::vector<Real> radii;
  for (int k = 0; k < balls.getSphereCount(); ++k) {
    centers.push_back(scale.cwiseProduct(to_vector(balls.getSpherePosition(k))));
    radii.push_back(Real(balls.getSphereRadius(k)) * scale.x());
    add_ball(list, centers.back(), radii.back());
  }
  for (std::size_t i = 0; i < centers.size(); ++i)
    for (std::size_t j = i + 1; j < centers.size(); ++j)
      if (radii[i] == radii[j]) add_segment(list, centers[i], centers[j], radii[i]);
}

void add_hull(List& list, const std::vector<btVector3>& corners, Real radius) {
  if (corners.empty()) return;
  btConvexHullComputer hull;
  hull.compute(&corners[0].m_floats[0], sizeof(btVector3), static_cast<int>(corners.size()), 0, 0);
  ShapeEdges& to = of_radius(list, radius);
  const auto first = static_cast<int>(to.points.size());
  for (int k = 0; k < hull.vertices.size(); ++k) add_point(to, to_vector(hull.vertices[k]));
  if (hull.vertices.size() == 1) to.edges.push_back({first, first});
  for (int k = 0; k < hull.edges.size(); ++k) {
    const int i = hull.edges[k].getSourceVertex(), j = hull.edges[k].getTargetVertex();
    if (i < j) to.edges.push_back({first + i, first + j});
  }
}

void add_convex(List& list, const btConvexShape& convex) {
  std::vector<btVector3> corners;
  if (convex.getShapeType() == CONVEX_HULL_SHAPE_PROXYTYPE) {
    const auto& hull = static_cast<const btConvexHullShape&>(convex);
    for (int k = 0; k < hull.getNumPoints(); ++k) corners.push_back(hull.getScaledPoint(k));
  } else {
    for (int k = 0; k < directions; ++k) {  // on a spiral over the unit sphere
      const Real z = 1 - (2 * k + 1) / Real(directions), angle = k * std::numbers::pi * (3 - std::sqrt(5.0));
      const Real r = std::sqrt(1 - z * z);
      corners.push_back(convex.localGetSupportingVertexWithoutMargin(
          to_bullet(Vector3(r * std::cos(angle), r * std::sin(angle), z))));
    }
  }
  add_hull(list, corners, convex.getMargin());
}

// Edges between triangles that do not lie in one plane, and those at which triangles end.
class Creases final : public btTriangleCallback {
 public:
  void processTriangle(btVector3* triangle, int, int) override {
    const std::array<Vector3, 3> x{to_vector(triangle[0]), to_vector(triangle[1]), to_vector(triangle[2])};
    const Vector3 face = (x[1] - x[0]).cross(x[2] - x[0]);
    if (!(face.norm() > 0)) return;
    std::array<int, 3> corner{};
    for (int k = 0; k < 3; ++k)
      corner[k] = numbers_.try_emplace(std::tuple(x[k].x(), x[k].y(), x[k].z()), static_cast<int>(numbers_.size()))
                      .first->second;
    points_.resize(numbers_.size());
    for (int k = 0; k < 3; ++k) points_[corner[k]] = x[k];
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(corner[k], corner[(k + 1) % 3]);
      const auto [edge, is_new] = edges_.try_emplace(Edge{low, high}, Side{face.normalized(), 1, true});
      if (is_new) continue;
      edge->second.is_flat = edge->second.is_flat && edge->second.normal.cross(face.normalized()).norm() < flat_edge;
      ++edge->second.count;
    }
  }

  void add_to(ShapeEdges& to) const {
    std::vector<int> kept(points_.size(), -1);
    const auto keep = [&](int point) {
      if (kept[point] < 0) kept[point] = add_point(to, points_[point]);
      return kept[point];
    };
    for (const auto& [edge, side] : edges_)
      if (side.count == 1 || !side.is_flat) {
        const int first = keep(edge[0]), second = keep(edge[1]);
        to.edges.push_back({first, second});
      }
  }

 private:
  struct Side {
    Vector3 normal;  // of the first triangle
    int count;
    bool is_flat;
  };
  std::map<std::tuple<Real, Real, Real>, int> numbers_;
  std::vector<Vector3> points_;
  std::map<Edge, Side> edges_;
};

void append(const btCollisionShape& shape, const Box& box, List& list);

void append_compound(const btCompoundShape& compound, const Box& box, List& list) {
  for (int child = 0; child < compound.getNumChildShapes(); ++child) {
    const btTransform& transform = compound.getChildTransform(child);
    const Matrix3 rotation = to_matrix(transform.getBasis());
    const Vector3 origin = to_vector(transform.getOrigin());
    List of_child;
    append(*compound.getChildShape(child), transformed(box, rotation.transpose(), -(rotation.transpose() * origin)),
           of_child);
    for (const ShapeEdges& from : of_child) {
      ShapeEdges& to = of_radius(list, from.radius);
      const auto first = static_cast<int>(to.points.size());
      for (const Vector3& point : from.points) add_point(to, rotation * point + origin);
      for (const auto& [i, j] : from.edges) to.edges.push_back({first + i, first + j});
    }
  }
}

void append(const btCollisionShape& shape, const Box& box, List& list) {
  switch (shape.getShapeType()) {
    case STATIC_PLANE_PROXYTYPE:
    case EMPTY_SHAPE_PROXYTYPE:
      return;
    case SPHERE_SHAPE_PROXYTYPE:
      return add_ball(list, Vector3::Zero(), static_cast<const btSphereShape&>(shape).getRadius());
    case BOX_SHAPE_PROXYTYPE:
      return add_box(list, to_vector(static_cast<const btBoxShape&>(shape).getHalfExtentsWithMargin()));
    case CAPSULE_SHAPE_PROXYTYPE: {
      const auto& capsule = static_cast<const btCapsuleShape&>(shape);
      const Vector3 end = Real(capsule.getHalfHeight()) * Vector3::Unit(capsule.getUpAxis());
      return add_segment(list, -end, end, capsule.getRadius());
    }
    case CYLINDER_SHAPE_PROXYTYPE:
      return add_cylinder(list, static_cast<const btCylinderShape&>(shape));
    case CONE_SHAPE_PROXYTYPE:
      return add_cone(list, static_cast<const btConeShape&>(shape));
    case MULTI_SPHERE_SHAPE_PROXYTYPE:
      return add_balls(list, static_cast<const btMultiSphereShape&>(shape));
    default:
      break;
  }
  if (shape.isCompound()) {
    append_compound(static_cast<const btCompoundShape&>(shape), box, list);
  } else if (shape.isConcave()) {
    Creases creases;
    static_cast<const btConcaveShape&>(shape).processAllTriangles(&creases, to_bullet(box.low), to_bullet(box.high));
    creases.add_to(of_radius(list, shape.getMargin()));
  } else if (shape.isConvex()) {
    add_convex(list, static_cast<const btConvexShape&>(shape));
  }
}

/// A number that is another one where vertices were moved.
class Hash final : public btTriangleCallback {
 public:
  void add(const btVector3& v) {
    for (int axis = 0; axis < 3; ++axis)
      value_ = (value_ ^ std::bit_cast<std::uint64_t>(Real(v[axis]))) * 0x100000001b3;
    value_ ^= value_ >> 29;
  }
  void processTriangle(btVector3* triangle, int, int) override {
    for (int k = 0; k < 3; ++k) add(triangle[k]);
  }
  Real value() const { return static_cast<Real>(value_ >> 11); }  // as many digits as a Real holds

 private:
  std::uint64_t value_ = 0xcbf29ce484222325;
};

void append_numbers(const btCollisionShape& shape, const Box& box, std::vector<Real>& numbers) {
  const auto add = [&](const btVector3& v) { numbers.insert(numbers.end(), {Real(v.x()), Real(v.y()), Real(v.z())}); };
  btVector3 low, high;
  shape.getAabb(btTransform::getIdentity(), low, high);
  numbers.insert(numbers.end(), {Real(shape.getShapeType()), Real(shape.getMargin())});
  add(low);
  add(high);
  if (shape.isCompound()) {
    const auto& compound = static_cast<const btCompoundShape&>(shape);
    for (int child = 0; child < compound.getNumChildShapes(); ++child) {
      const btTransform& transform = compound.getChildTransform(child);
      for (int row = 0; row < 3; ++row) add(transform.getBasis()[row]);
      add(transform.getOrigin());
      const Matrix3 rotation = to_matrix(transform.getBasis()).transpose();
      append_numbers(*compound.getChildShape(child),
                     transformed(box, rotation, -(rotation * to_vector(transform.getOrigin()))), numbers);
    }
  } else if (shape.getShapeType() == CONVEX_HULL_SHAPE_PROXYTYPE) {
    const auto& hull = static_cast<const btConvexHullShape&>(shape);
    Hash hash;
    for (int k = 0; k < hull.getNumPoints(); ++k) hash.add(hull.getUnscaledPoints()[k]);
    numbers.push_back(hash.value());
  } else if (shape.isConcave() && (box.low.array() <= box.high.array()).all()) {
    Hash hash;
    static_cast<const btConcaveShape&>(shape).processAllTriangles(&hash, to_bullet(box.low), to_bullet(box.high));
    numbers.push_back(hash.value());
  }
}

}  // namespace

Box transformed(const Box& box, const Matrix3& rotation, const Vector3& origin) {
  const Vector3 center = rotation * ((box.low + box.high) / 2) + origin;
  const Vector3 half = rotation.cwiseAbs() * ((box.high - box.low) / 2);
  return {center - half, center + half};
}

bool ShapeEdges::reach_into(const Box& box) const {
  return std::any_of(edges.begin(), edges.end(), [&](const Edge& edge) {
    Box own;
    own.add(points[edge[0]]);
    own.add(points[edge[1]]);
    return own.overlaps(box, radius);
  });
}

List edges_of(const btCollisionShape& shape, const Box& box) {
  List list;
  append(shape, box, list);
  std::erase_if(list, [](const ShapeEdges& edges) { return edges.points.empty(); });
  return list;
}

std::vector<Real> fingerprint_of(const btCollisionShape& shape, const Box& box) {
  std::vector<Real> numbers;
  append_numbers(shape, box, numbers);
  return numbers;
}

bool is_concave(const btCollisionShape& shape) {
  if (!shape.isCompound()) return shape.isConcave();
  const auto& compound = static_cast<const btCompoundShape&>(shape);
  for (int child = 0; child < compound.getNumChildShapes(); ++child)
    if (is_concave(*compound.getChildShape(child))) return true;
  return false;
}

}  // namespace penalty
