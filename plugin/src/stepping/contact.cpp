#include "penalty/stepping/contact.h"

#include <algorithm>

namespace penalty {
namespace {

constexpr Real depth_decay_time = 0.05;          // [s]
constexpr Real largest_depth_correction = 0.01;  // share of the depth a sweep takes back

Vector3 weighted_sum(const ContactPoint& point, const PackedVectors& vectors) {
  Vector3 sum = Vector3::Zero();
  for (int k = 0; k < point.num_particles; ++k)
    sum += point.weights[k] * Eigen::Map<const Vector3>(vectors.data() + 4 * point.particles[k]);
  return sum;
}

// Adds to each particle its share of a push on the point: weight * inverse mass * push.
void distribute(const ContactPoint& point, const std::vector<Real>& inverse_masses, const Vector3& push,
                PackedVectors& vectors) {
  for (int k = 0; k < point.num_particles; ++k)
    Eigen::Map<Vector3>(vectors.data() + 4 * point.particles[k]) +=
        point.weights[k] * inverse_masses[point.particles[k]] * push;
}

// Inverse of the mass that an impulse along `direction` at `arm` meets.
Real mobility(const RigidBody& body, const Vector3& arm, const Vector3& direction) {
  const Vector3 moment = arm.cross(direction);
  return direction.dot(body.inverse_mass.cwiseProduct(direction)) + moment.dot(body.inverse_inertia * moment);
}

}  // namespace

ContactWork solve_contacts(std::span<Contact> contacts, Particles& particles, std::span<RigidBody> rigid_bodies,
                           Real duration, Real slop) {
  ContactWork work;
  for (Contact& contact : contacts) {
    RigidBody& body = rigid_bodies[contact.rigid_body];
    contact.impulse.setZero();
    Real point_mobility = 0;
    for (int k = 0; k < contact.point.num_particles; ++k)
      point_mobility +=
          contact.point.weights[k] * contact.point.weights[k] * particles.inverse_masses[contact.point.particles[k]];
    if (point_mobility <= 0) continue;

    const Vector3 arm = weighted_sum(contact.point, particles.positions) - body.position;
    const Vector3 offset = arm - body.rotation * contact.anchor;
    Vector3 normal = body.rotation * contact.normal;
    if (contact.radius > 0 && !offset.isZero(0)) normal = offset.normalized();
    const Real gap = normal.dot(offset) - contact.radius;
    contact.depth = std::max(contact.depth, -gap);
    const Vector3 obstacle_velocity = body.velocity_at(arm);
    const Vector3 relative = weighted_sum(contact.point, particles.velocities) - obstacle_velocity;
    const Real normal_speed = normal.dot(relative);

    if (-gap > slop && !body.is_dynamic()) {
      const Real share = std::min(largest_depth_correction, duration / depth_decay_time);
      distribute(contact.point, particles.inverse_masses, normal * (share * (-gap - slop) / point_mobility),
                 particles.positions);
    }

    const Real wanted = gap > 0 ? -gap / duration : 0;
    if (normal_speed >= wanted) continue;
    const Real normal_impulse = (wanted - normal_speed) / (point_mobility + mobility(body, arm, normal));
    Vector3 impulse = normal_impulse * normal;
    const Vector3 slip = relative - normal_speed * normal;
    const Real slip_speed = slip.norm();
    if (contact.friction > 0 && slip_speed > 1e-12) {
      const Vector3 direction = slip / slip_speed;
      const Real stopping = slip_speed / (point_mobility + mobility(body, arm, direction));
      impulse -= std::min(contact.friction * normal_impulse, stopping) * direction;
    }

    contact.impulse = impulse;
    const Vector3 point_velocity = relative + obstacle_velocity;
    const Real on_particles = impulse.dot(point_velocity) + point_mobility / 2 * impulse.squaredNorm();
    work.particles += on_particles;
    work.loss += impulse.dot(obstacle_velocity) - mobility(body, arm, impulse) / 2 - on_particles;
    distribute(contact.point, particles.inverse_masses, impulse, particles.velocities);
    if (body.is_dynamic()) {
      const Vector3 moment = arm.cross(impulse);
      body.velocity -= body.inverse_mass.cwiseProduct(impulse);
      body.angular_velocity -= body.inverse_inertia * moment;
      body.impulse -= impulse;
      body.angular_impulse -= moment;
    } else {
      work.obstacles += impulse.dot(obstacle_velocity);
    }
  }
  return work;
}

}  // namespace penalty
