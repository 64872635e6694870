// Bodies to step, and the momenta of everything in an island.
#pragma once
#include <memory>

#include "fields/meshes.h"
#include "penalty/stepping/step.h"

namespace penalty::testing {

/// A stepped body together with the field that it needs.
struct Body {
  std::unique_ptr<PotentialField> field;
  SteppedBody body;

  Particles& particles() { return body.particles; }
  const Particles& particles() const { return body.particles; }
  Vector3 position(int i) const;
  Vector3 velocity(int i) const;
  void set_position(int i, const Vector3& x);
  void set_velocity(int i, const Vector3& v);
  Real energy() const { return body.elastic_energy + kinetic_energy(body.particles); }
};

Body make_body(PotentialField field, std::vector<Real> inverse_masses);

/// The beam 4 x 1 x 1 m of `cells_across` cells, equal masses that sum to 4000 kg.
Body make_beam_body(int cells_across, const Material& material = {.young = 1e6, .poisson = 0.4});

/// Particles without forces between them.
Body make_free_particles(const Eigen::Matrix3Xd& positions, std::vector<Real> masses);

void advance(Body& body, Real duration, std::span<RigidBody> rigid_bodies = {});

/// A uniform solid sphere.
RigidBody make_sphere(Real mass, Real radius, const Vector3& position);

struct Momentum {
  Vector3 linear, angular;  // the latter about the origin
};

Momentum momentum(std::initializer_list<const Body*> bodies, std::span<const RigidBody> rigid_bodies = {});

}  // namespace penalty::testing
