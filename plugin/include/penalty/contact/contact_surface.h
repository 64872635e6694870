// What of a body may touch, in patches that keep account of how far they have moved.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "penalty/contact/box_tree.h"
#include "penalty/contact/closest_points.h"
#include "penalty/contact/weighted_point.h"
#include "penalty/fields/topology.h"

namespace penalty {

/// A part of a surface that is near together at rest. Each point, edge and triangle of a surface belongs to one patch.
struct SurfacePatch {
  std::vector<int> points, edges, triangles;  // of this patch, indices into those of the surface
  std::vector<int> all_points;                // those of its edges and triangles, too
  BoxTree edge_tree, triangle_tree;           // over `edges` and `triangles`
  Box box;                                    // of all its points
  Box rest_box;                               // and at rest
  std::uint64_t box_at = 0, trees_at = 0;     // instants of the box, and of the boxes of the trees

  Vector3 mean_velocity = Vector3::Zero();  // of its points [m/s]
  Real speed = 0;                           // largest of a point about that mean [m/s]
  Vector3 shift = Vector3::Zero();          // integral of the mean velocity [m]
  Real path = 0;                            // integral of the speed [m]
};

/// Points, edges and triangles that may touch others'. A point is one of particles, or of an embedded surface: all
/// geometry is done on the points, and impulses go to their particles. Or all of them are fixed in the frame of a rigid
/// body: its corners and edges, the centre of a ball, the axis of a capsule.
class ContactSurface {
 public:
  /// `edges` are those of no triangle: a rope. `rest` are positions of the particles [m]. Points that stand in no edge
  /// and no triangle may touch triangles, too. A closed surface whose triangles look inwards is turned. Throws
  /// std::invalid_argument that names a point that is none of the particles, a triangle or edge whose index is outside
  /// the points.
  ContactSurface(std::vector<WeightedPoint> points, std::vector<Triangle> triangles, const std::vector<Edge>& edges,
                 const Positions& rest);

  /// Points in the frame of a rigid body [m] and edges between them; an edge from a point to itself is that point, for
  /// those that meet no points. The body reaches `radius` [m] beyond each. Throws like the other.
  ContactSurface(std::span<const Vector3> points, const std::vector<Edge>& edges, Real radius);

  bool is_rigid() const { return is_rigid_; }
  Real radius() const { return radius_; }  // [m]

  int num_points() const { return static_cast<int>(rest_.cols()); }
  std::span<const WeightedPoint> points() const { return points_; }  // none of a rigid body
  std::span<const Triangle> triangles() const { return triangles_; }
  std::span<const Edge> edges() const { return edges_; }  // all of them
  bool has_triangle(int edge) const { return has_triangle_[edge] != 0; }
  std::span<const SurfacePatch> patches() const { return patches_; }

  /// Each edge has one triangle on either side: there is an inside, behind the triangles.
  bool is_closed() const { return is_closed_; }
  Real mean_edge() const { return mean_edge_; }        // at rest; zero without edges [m]
  Real longest_edge() const { return longest_edge_; }  // likewise

  Real margin = 0;    // distance that it keeps from itself, and from others the mean of both [m]
  Real friction = 0;  // Coulomb coefficient, to be multiplied with the other's

  /// Takes the points from where the particles are now; before a step it forgets what was known if that is not where the
  /// last drift left them: somebody else moved them. `first`: the column of the first particle of the body.
  void begin_step(const PackedVectors& positions);
  void take_positions(const PackedVectors& positions, Eigen::Index first = 0);
  void take_velocities(const PackedVectors& velocities, Eigen::Index first = 0);

  /// The same of a rigid body: where its frame is, and how it moves about its origin [m/s], [rad/s]. A move by others that
  /// is small against the margin, as round-off is, counts as one of its own.
  void begin_step(const Vector3& origin, const Matrix3& rotation);
  void take_positions(const Vector3& origin, const Matrix3& rotation);
  void take_velocities(const Vector3& velocity, const Vector3& angular_velocity);
  /// Velocities that bring it from where it is to there in a second.
  void take_way_to(const Vector3& origin, const Matrix3& rotation);

  /// What a point of a rigid body that moves on for `duration` [s] ends off the straight line, at most [m].
  Real bend(Real duration) const;

  /// The points move on for `duration` [s] at the velocities that were taken last: accounts of the patches, no more.
  void drift(Real duration);

  /// All that was known of distances is void, accounts begin anew.
  void forget();
  std::uint64_t epoch() const { return epoch_; }

  /// Grows whenever positions are taken.
  std::uint64_t instant() const { return instant_; }

  Vector3 position(int point) const { return positions_.col(point).head<3>(); }
  Vector3 velocity(int point) const { return velocities_.col(point).head<3>(); }
  Vector3 rest_position(int point) const { return rest_.col(point).head<3>(); }

  Box box_of_edge(int edge) const;
  Box box_of_triangle(int triangle) const;

  /// Of a patch where it is now, and of its trees, too.
  const Box& box_of_patch(int patch);
  const SurfacePatch& refitted(int patch);

  /// The triangle that is nearest to x; none has the number -1.
  struct Nearest {
    int triangle = -1;
    ClosestPoints closest{};  // of x and the triangle
  };
  Nearest nearest(const Vector3& x);

  /// How often the surface winds around x: 0 outside, 1 inside a closed one; at O(triangles). A. Jacobson et al., Robust
  /// Inside-Outside Segmentation using Generalized Winding Numbers (2013), eq. 5 and 6.
  Real winding_number(const Vector3& x) const;

 private:
  void connect(const std::vector<Edge>& edges);
  void cut_into_patches();
  void measure_patches();
  Real signed_volume() const;  // at rest [m³]

  std::vector<WeightedPoint> points_;
  std::vector<Triangle> triangles_;
  std::vector<Edge> edges_;
  std::vector<char> has_triangle_;  // each edge
  std::vector<SurfacePatch> patches_;
  PackedVectors rest_, positions_, velocities_;  // the first in the frame of a rigid body
  bool is_rigid_ = false;
  Real radius_ = 0, reach_ = 0;  // the latter of its points from the origin [m]
  Vector3 origin_ = Vector3::Zero(), velocity_ = Vector3::Zero(), angular_velocity_ = Vector3::Zero();
  Matrix3 rotation_ = Matrix3::Identity();
  bool is_closed_ = false;
  Real mean_edge_ = 0, longest_edge_ = 0;
  std::uint64_t epoch_ = 1, instant_ = 1;  // the latter of the positions
};

}  // namespace penalty
