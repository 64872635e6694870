#include "stepping/islands.h"

#include <Eigen/LU>

namespace penalty::testing {

Vector3 Body::position(int i) const { return body.particles.positions.col(i).head<3>(); }
Vector3 Body::velocity(int i) const { return body.particles.velocities.col(i).head<3>(); }
void Body::set_position(int i, const Vector3& x) { body.particles.positions.col(i).head<3>() = x; }
void Body::set_velocity(int i, const Vector3& v) { body.particles.velocities.col(i).head<3>() = v; }

void Body::touch(const WeightedPoint& point, int rigid, const Vector3& anchor, const Vector3& normal, Real friction) {
  contacts.push_back(
      {.a = Side::of_particles(0, point), .b = Side::of_rigid(rigid, anchor), .normal = normal, .friction = friction});
}

Body make_body(PotentialField field, std::vector<Real> inverse_masses) {
  Body result;
  result.field = std::make_unique<PotentialField>(std::move(field));
  const PackedVectors& rest = result.field->rest_positions();
  result.body.particles = {rest, PackedVectors::Zero(4, rest.cols()), std::move(inverse_masses)};
  result.body.field = result.field.get();
  estimate_stability(result.body);
  return result;
}

Body make_beam_body(int cells_across, const Material& material) {
  const TetMesh mesh = make_beam(cells_across);
  const auto num_particles = mesh.vertices.cols();
  return make_body(make_elastic_field(mesh.vertices, mesh.tetrahedra, material),
                   std::vector<Real>(num_particles, static_cast<Real>(num_particles) / 4000));
}

Body make_stretched_cube(Real stiffness, Real stretch) {
  const TetMesh mesh = make_box({1, 1, 1}, {4, 4, 4});
  const auto count = mesh.vertices.cols();
  Body cube = make_body(make_elastic_field(mesh.vertices, mesh.tetrahedra, stiffness),
                        std::vector<Real>(static_cast<std::size_t>(count), static_cast<Real>(count)));
  cube.particles().positions.row(0) *= stretch;
  for (int i = 0; i < count; ++i)
    cube.set_velocity(i, Vector3(0.3, -0.2, 0.1) + Vector3(0.5, 1, -0.7).cross(cube.position(i)));
  cube.body.positions_changed();
  return cube;
}

Body implicit(Body body) {
  body.body.options.integrator = Integrator::implicit_step;
  return body;
}

Body converged(Body body) {
  body.body.options.newton_tolerance = 1e-11;
  body.body.options.newton_iterations = 60;
  body.body.options.linear = {1000, 1e-10};
  return body;
}

Body make_free_particles(const Eigen::Matrix3Xd& positions, std::vector<Real> masses) {
  for (Real& m : masses) m = 1 / m;
  return make_body(PotentialField(positions), std::move(masses));
}

void advance(const std::vector<Body*>& bodies, Real duration, std::span<RigidBody> rigid_bodies,
             const std::vector<Coupling*>& couplings) {
  Island island;
  island.rigid_bodies.assign(rigid_bodies.begin(), rigid_bodies.end());
  island.couplings = couplings;
  for (Body* body : bodies) {
    for (Contact contact : body->contacts) {
      contact.a.body = static_cast<int>(island.bodies.size());
      island.contacts.push_back(contact);
    }
    island.bodies.push_back(&body->body);
  }
  for (Coupling* coupling : couplings) estimate_stability(*coupling, island, false);
  penalty::advance(island, duration);
  std::copy(island.rigid_bodies.begin(), island.rigid_bodies.end(), rigid_bodies.begin());
}

void advance(Body& body, Real duration, std::span<RigidBody> rigid_bodies) {
  advance(std::vector<Body*>{&body}, duration, rigid_bodies);
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
