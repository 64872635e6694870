// Bodies to step, islands of them, and the momenta of everything in an island.
#pragma once
#include <memory>

#include "fields/meshes.h"
#include "penalty/stepping/island.h"

namespace penalty::testing {

inline constexpr Real frame = 1.0 / 60;  // [s]
inline constexpr Real g = 9.81;          // [m/s²]

/// A stepped body together with the field that it needs, and the contacts of its next step.
struct Body {
  std::unique_ptr<PotentialField> field;
  SteppedBody body;
  std::vector<Contact> contacts = {};  // whose sides a are numbered by `advance`

  Particles& particles() { return body.particles; }
  const Particles& particles() const { return body.particles; }
  Vector3 position(int i) const;
  Vector3 velocity(int i) const;
  void set_position(int i, const Vector3& x);
  void set_velocity(int i, const Vector3& v);
  Real energy() const { return body.elastic_energy + kinetic_energy(body.particles); }

  /// A contact of `point` with the plane through `anchor` of rigid body number `rigid`.
  void touch(const WeightedPoint& point, int rigid, const Vector3& anchor, const Vector3& normal, Real friction = 0);
};

Body make_body(PotentialField field, std::vector<Real> inverse_masses);

/// The beam 4 x 1 x 1 m of `cells_across` cells, equal masses that sum to 4000 kg.
Body make_beam_body(int cells_across, const Material& material = {.young = 1e6, .poisson = 0.4});

/// A cube of 4 x 4 x 4 cells, 1 kg, with one stiffness for every element: stretched along x, drifting and turning.
Body make_stretched_cube(Real stiffness, Real stretch);

/// To be stepped implicitly; and by iterations that go on until nothing is left.
Body implicit(Body body);
Body converged(Body body);

/// Particles without forces between them.
Body make_free_particles(const Eigen::Matrix3Xd& positions, std::vector<Real> masses);

/// Steps bodies with their contacts, the rigid bodies that these are with, and couplings, as one island.
void advance(const std::vector<Body*>& bodies, Real duration, std::span<RigidBody> rigid_bodies = {},
             const std::vector<Coupling*>& couplings = {});
void advance(Body& body, Real duration, std::span<RigidBody> rigid_bodies = {});

/// A uniform solid sphere.
RigidBody make_sphere(Real mass, Real radius, const Vector3& position);

struct Momentum {
  Vector3 linear, angular;  // the latter about the origin
};

Momentum momentum(std::initializer_list<const Body*> bodies, std::span<const RigidBody> rigid_bodies = {});

}  // namespace penalty::testing
