#include "stepping/islands.h"

#include <Eigen/LU>

namespace penalty::testing {

Vector3 Body::position(int i) const { return body.particles.positions.col(i).head<3>(); }
Vector3 Body::velocity(int i) const { return body.particles.velocities.col(i).head<3>(); }
void Body::set_position(int i, const Vector3& x) { body.particles.positions.col(i).head<3>() = x; }
void Body::set_velocity(int i, const Vector3& v) { body.particles.velocities.col(i).head<3>() = v; }

Body make_body(PotentialField field, std::vector<Real> inverse_masses) {
  Body result;
  result.field = std::make_unique<PotentialField>(std::move(field));
  const PackedVectors& rest = result.field->rest_positions();
  result.body.particles = {rest, PackedVectors::Zero(4, rest.cols()), std::move(inverse_masses)};
  result.body.potential = result.field.get();
  estimate_stability(result.body, rest);
  return result;
}

Body make_beam_body(int cells_across, const Material& material) {
  const TetMesh mesh = make_beam(cells_across);
  const auto num_particles = mesh.vertices.cols();
  return make_body(make_elastic_field(mesh.vertices, mesh.tetrahedra, material),
                   std::vector<Real>(num_particles, static_cast<Real>(num_particles) / 4000));
}

Body make_free_particles(const Eigen::Matrix3Xd& positions, std::vector<Real> masses) {
  for (Real& m : masses) m = 1 / m;
  return make_body(PotentialField(positions), std::move(masses));
}

void advance(Body& body, Real duration, std::span<RigidBody> rigid_bodies) {
  SteppedBody* bodies[] = {&body.body};
  penalty::advance(bodies, rigid_bodies, duration);
}

RigidBody make_sphere(Real mass, Real radius, const Vector3& position) {
  RigidBody sphere;
  sphere.position = position;
  sphere.inverse_mass.setConstant(1 / mass);
  sphere.inverse_inertia = Matrix3::Identity() / (0.4 * mass * radius * radius);
  return sphere;
}

Momentum momentum(std::initializer_list<const Body*> bodies, std::span<const RigidBody> rigid_bodies) {
  Momentum sum{Vector3::Zero(), Vector3::Zero()};
  for (const Body* body : bodies) {
    sum.linear += linear_momentum(body->particles());
    sum.angular += angular_momentum(body->particles());
  }
  for (const RigidBody& body : rigid_bodies) {
    if (!body.is_dynamic()) continue;
    const Vector3 p = body.velocity.cwiseQuotient(body.inverse_mass);
    sum.linear += p;
    sum.angular += body.position.cross(p) + body.inverse_inertia.inverse() * body.angular_velocity;
  }
  return sum;
}

}  // namespace penalty::testing
