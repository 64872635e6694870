#include "penalty/contact/contact_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "halves.h"

namespace penalty {
namespace {

constexpr std::size_t largest_patch = 64;  // triangles, or edges of a rope, or lone points
constexpr Real own_move = 0.05;            // share of the margin by which others may move a rigid body unnoticed

PackedVectors points_of(std::span<const WeightedPoint> points, const Positions& particles) {
  PackedVectors result = PackedVectors::Zero(4, static_cast<Eigen::Index>(points.size()));
  for (std::size_t k = 0; k < points.size(); ++k)
    for (int i = 0; i < points[k].size; ++i)
      result.col(static_cast<Eigen::Index>(k)) += points[k].weights[i] * particles.col(points[k].particles[i]);
  return result;
}

template <std::size_t N>
void check(const std::vector<std::array<int, N>>& elements, int num_points, const char* element) {
  for (std::size_t e = 0; e < elements.size(); ++e)
    for (const int point : elements[e])
      if (point < 0 || point >= num_points)
        throw std::invalid_argument(std::string("contact surface: ") + element + " " + std::to_string(e) + ": index " +
                                    std::to_string(point) + " is outside the " + std::to_string(num_points) +
                                    " points");
}

Edge between(int i, int j) { return {std::min(i, j), std::max(i, j)}; }

bool every_edge_has_two_sides(std::span<const Triangle> triangles) {
  std::map<Edge, int> ways;  // ways through an edge: +1 from the lower index to the upper, and back
  std::map<Edge, int> count;
  for (const Triangle& t : triangles)
    for (int k = 0; k < 3; ++k) {
      const int from = t[k], to = t[(k + 1) % 3];
      const Edge edge = between(from, to);
      ways[edge] += from < to ? 1 : -1;
      ++count[edge];
    }
  for (const auto& [edge, number] : count)
    if (number != 2 || ways[edge] != 0) return false;
  return !triangles.empty();
}

}  // namespace

ContactSurface::ContactSurface(std::vector<WeightedPoint> points, std::vector<Triangle> triangles,
                               const std::vector<Edge>& edges, const Positions& rest)
    : points_(std::move(points)), triangles_(std::move(triangles)) {
  for (std::size_t k = 0; k < points_.size(); ++k)
    points_[k].check(static_cast<int>(rest.cols()), "contact surface: point " + std::to_string(k));
  rest_ = points_of(points_, rest);
  connect(edges);
  take_positions(rest);
}

ContactSurface::ContactSurface(std::span<const Vector3> points, const std::vector<Edge>& edges, Real radius)
    : is_rigid_(true), radius_(radius) {
  rest_ = PackedVectors::Zero(4, static_cast<Eigen::Index>(points.size()));
  for (std::size_t k = 0; k < points.size(); ++k) {
    rest_.col(static_cast<Eigen::Index>(k)).head<3>() = points[k];
    reach_ = std::max(reach_, points[k].norm());
  }
  connect(edges);
}

// Edges of triangles, then the others.
void ContactSurface::connect(const std::vector<Edge>& edges) {
  check(triangles_, num_points(), "triangle");
  check(edges, num_points(), "edge");
  edges_ = edges_of(std::span<const Triangle>(triangles_));
  has_triangle_.assign(edges_.size(), 1);
  const std::size_t num_of_triangles = edges_.size();
  for (const auto& [i, j] : edges)
    if (!std::binary_search(edges_.begin(), edges_.begin() + static_cast<std::ptrdiff_t>(num_of_triangles),
                            between(i, j)))
      edges_.push_back(between(i, j));
  std::sort(edges_.begin() + static_cast<std::ptrdiff_t>(num_of_triangles), edges_.end());
  edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  has_triangle_.resize(edges_.size(), 0);
  for (const auto& [i, j] : edges_) {
    const Real length = (rest_position(i) - rest_position(j)).norm();
    mean_edge_ += length;
    longest_edge_ = std::max(longest_edge_, length);
  }
  if (!edges_.empty()) mean_edge_ /= static_cast<Real>(edges_.size());
  is_closed_ = every_edge_has_two_sides(triangles_);
  if (is_closed_ && signed_volume() < 0)
    for (Triangle& t : triangles_) std::swap(t[1], t[2]);
  positions_ = rest_;
  velocities_ = PackedVectors::Zero(4, rest_.cols());
  cut_into_patches();
}

Real ContactSurface::signed_volume() const {
  Real sum = 0;
  const Vector3 origin = rest_position(0);
  for (const auto& [i, j, k] : triangles_)
    sum += (rest_position(i) - origin).dot((rest_position(j) - origin).cross(rest_position(k) - origin)) / 6;
  return sum;
}

// Triangles, then what no triangle has: edges, then points. Each edge and point goes with the first that has it.
void ContactSurface::cut_into_patches() {
  std::vector<char> has_point(num_points(), 0);
  std::map<Edge, int> edge_number;
  for (std::size_t e = 0; e < edges_.size(); ++e) edge_number[edges_[e]] = static_cast<int>(e);
  std::vector<char> has_edge(edges_.size(), 0);
  const auto take_point = [&](SurfacePatch& patch, int point) {
    patch.all_points.push_back(point);
    if (std::exchange(has_point[point], 1) == 0) patch.points.push_back(point);
  };
  const auto take_edge = [&](SurfacePatch& patch, int edge) {
    if (std::exchange(has_edge[edge], 1) == 0) patch.edges.push_back(edge);
    for (const int point : edges_[edge]) take_point(patch, point);
  };
  const auto take_triangle = [&](SurfacePatch& patch, int triangle) {
    patch.triangles.push_back(triangle);
    const Triangle& t = triangles_[triangle];
    for (int k = 0; k < 3; ++k) take_edge(patch, edge_number.at(between(t[k], t[(k + 1) % 3])));
  };

  const auto cut = [&](auto& self, std::span<int> items, std::span<const Vector3> centers, const auto& take) -> void {
    if (items.empty()) return;
    if (items.size() > largest_patch) {
      const std::size_t middle = halve(items, centers);
      self(self, items.first(middle), centers, take);
      self(self, items.subspan(middle), centers, take);
      return;
    }
    SurfacePatch& patch = patches_.emplace_back();
    std::sort(items.begin(), items.end());
    for (const int item : items) take(patch, item);
  };
  const auto cut_all = [&](std::vector<int> items, std::size_t count, const auto& center, const auto& take) {
    std::vector<Vector3> centers;
    centers.reserve(count);
    for (std::size_t k = 0; k < count; ++k) centers.push_back(center(static_cast<int>(k)));
    cut(cut, items, centers, take);
  };
  const auto left = [](std::span<const char> taken) {
    std::vector<int> items;
    for (std::size_t k = 0; k < taken.size(); ++k)
      if (!taken[k]) items.push_back(static_cast<int>(k));
    return items;
  };
  const auto center_of = [this](const auto& element) {
    Vector3 sum = Vector3::Zero();
    for (const int point : element) sum += rest_position(point);
    return Vector3(sum / static_cast<Real>(element.size()));
  };
  std::vector<int> all(triangles_.size());
  std::iota(all.begin(), all.end(), 0);
  cut_all(all, triangles_.size(), [&](int t) { return center_of(triangles_[t]); }, take_triangle);
  cut_all(left(has_edge), edges_.size(), [&](int e) { return center_of(edges_[e]); }, take_edge);
  cut_all(left(has_point), num_points(), [&](int i) { return rest_position(i); }, take_point);

  for (SurfacePatch& patch : patches_) {
    std::sort(patch.all_points.begin(), patch.all_points.end());
    patch.all_points.erase(std::unique(patch.all_points.begin(), patch.all_points.end()), patch.all_points.end());
    std::vector<Box> boxes;
    boxes.reserve(std::max(patch.edges.size(), patch.triangles.size()));
    for (const int e : patch.edges) boxes.push_back(box_of_edge(e));
    patch.edge_tree = BoxTree(boxes);
    boxes.clear();
    for (const int t : patch.triangles) boxes.push_back(box_of_triangle(t));
    patch.triangle_tree = BoxTree(boxes);
    for (const int point : patch.all_points) patch.rest_box.add(rest_position(point));
  }
}

Box ContactSurface::box_of_edge(int edge) const {
  Box box;
  for (const int point : edges_[edge]) box.add(position(point));
  return box;
}

Box ContactSurface::box_of_triangle(int triangle) const {
  Box box;
  for (const int point : triangles_[triangle]) box.add(position(point));
  return box;
}

void ContactSurface::take_positions(const PackedVectors& positions, Eigen::Index first) {
  for (std::size_t k = 0; k < points_.size(); ++k)
    positions_.col(static_cast<Eigen::Index>(k)).head<3>() = points_[k].of(positions, first);
  ++instant_;
}

void ContactSurface::begin_step(const PackedVectors& positions) {
  for (std::size_t k = 0; k < points_.size(); ++k)
    if (position(static_cast<int>(k)) != points_[k].of(positions)) {
      forget();
      break;
    }
  take_positions(positions);
}

void ContactSurface::take_velocities(const PackedVectors& velocities, Eigen::Index first) {
  for (std::size_t k = 0; k < points_.size(); ++k)
    velocities_.col(static_cast<Eigen::Index>(k)).head<3>() = points_[k].of(velocities, first);
  measure_patches();
}

void ContactSurface::begin_step(const Vector3& origin, const Matrix3& rotation) {
  if (origin == origin_ && rotation == rotation_) return;
  const Real moved = (origin - origin_).norm() + reach_ * (rotation - rotation_).norm();
  if (moved <= own_move * margin)
    for (SurfacePatch& patch : patches_) patch.path += moved;
  else
    forget();
  take_positions(origin, rotation);
}

void ContactSurface::take_positions(const Vector3& origin, const Matrix3& rotation) {
  if (origin == origin_ && rotation == rotation_) return;
  origin_ = origin;
  rotation_ = rotation;
  positions_.topRows<3>() = (rotation * rest_.topRows<3>()).colwise() + origin;
  ++instant_;
}

void ContactSurface::take_velocities(const Vector3& velocity, const Vector3& angular_velocity) {
  const bool same_spin = angular_velocity.isZero(0) && angular_velocity_.isZero(0);
  if (velocity == velocity_ && same_spin) return;
  velocity_ = velocity;
  angular_velocity_ = angular_velocity;
  for (Eigen::Index k = 0; k < positions_.cols(); ++k)
    velocities_.col(k).head<3>() = velocity + angular_velocity.cross(position(static_cast<int>(k)) - origin_);
  measure_patches();
}

void ContactSurface::take_way_to(const Vector3& origin, const Matrix3& rotation) {
  const Eigen::AngleAxis<Real> turn(Matrix3(rotation * rotation_.transpose()));
  take_velocities(origin - origin_, turn.angle() * turn.axis());
}

Real ContactSurface::bend(Real duration) const {
  const Real angle = duration * angular_velocity_.norm();
  return reach_ * angle * angle / 2;
}

void ContactSurface::measure_patches() {
  for (SurfacePatch& patch : patches_) {
    Vector3 sum = Vector3::Zero();
    for (const int point : patch.all_points) sum += velocity(point);
    patch.mean_velocity = sum / static_cast<Real>(patch.all_points.size());
    Real largest2 = 0;
    for (const int point : patch.all_points)
      largest2 = std::max(largest2, (velocity(point) - patch.mean_velocity).squaredNorm());
    patch.speed = std::sqrt(largest2);
  }
}

void ContactSurface::forget() {
  ++epoch_;
  for (SurfacePatch& patch : patches_) {  // an attempt that was undone may have left anything
    patch.shift.setZero();
    patch.path = 0;
  }
}

void ContactSurface::drift(Real duration) {
  for (SurfacePatch& patch : patches_) {
    patch.shift += duration * patch.mean_velocity;
    patch.path += duration * patch.speed;
  }
}

const Box& ContactSurface::box_of_patch(int patch) {
  SurfacePatch& p = patches_[patch];
  if (p.box_at != instant_) {
    p.box_at = instant_;
    p.box = {};
    for (const int point : p.all_points) p.box.add(position(point));
  }
  return p.box;
}

const SurfacePatch& ContactSurface::refitted(int patch) {
  SurfacePatch& p = patches_[patch];
  box_of_patch(patch);
  if (p.trees_at != instant_) {
    p.trees_at = instant_;
    p.edge_tree.refit([&](int k) { return box_of_edge(p.edges[k]); });
    p.triangle_tree.refit([&](int k) { return box_of_triangle(p.triangles[k]); });
  }
  return p;
}

ContactSurface::Nearest ContactSurface::nearest(const Vector3& x) {
  Nearest found;
  Real distance = std::numeric_limits<Real>::max();
  Box at;
  at.add(x);
  for (int k = 0; k < static_cast<int>(patches_.size()); ++k) {
    if (box_of_patch(k).gap_to(at) >= distance) continue;
    const SurfacePatch& patch = refitted(k);
    patch.triangle_tree.visit(at, distance, [&](int item) {
      const auto& [i, j, l] = triangles_[patch.triangles[item]];
      const ClosestPoints closest = closest_points_of_triangle(x, position(i), position(j), position(l));
      if (closest.difference.norm() >= distance) return;
      distance = closest.difference.norm();
      found = {patch.triangles[item], closest};
    });
  }
  return found;
}

Real ContactSurface::winding_number(const Vector3& x) const {
  Real angle = 0;
  for (const auto& [i, j, k] : triangles_) {
    const Vector3 a = position(i) - x, b = position(j) - x, c = position(k) - x;
    const Real la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return angle / (4 * std::numbers::pi);
}

}  // namespace penalty
