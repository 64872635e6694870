#include "nodes.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "convert.h"
#include "penalty/math/text.h"

namespace penalty {
namespace {

bool is_finite(const btVector3& v) { return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z()); }

bool is_inverse_mass(btScalar inverse_mass) { return inverse_mass >= 0 && std::isfinite(inverse_mass); }

[[noreturn]] void refuse(int node, const std::string& what, Real value, const char* range) {
  throw std::invalid_argument("attach: node " + std::to_string(node) + ": " + what + " is " + to_text(value) +
                              ", must be " + range);
}

void check(const btVector3& v, int node, const std::string& what) {
  for (int axis = 0; axis < 3; ++axis)
    if (!std::isfinite(v[axis])) refuse(node, what + " " + "xyz"[axis], Real(v[axis]), "finite");
}

// Names the first that has a node of another body: of faces, or of links where there are none. Empty: none has.
std::string foreign_part(const btSoftBody& body) {
  const auto foreign = [&body](const char* what, const auto& parts, int corners) -> std::string {
    for (int i = 0; i < parts.size(); ++i)
      for (int k = 0; k < corners; ++k)
        if (index_of(body, parts[i].m_n[k]) < 0)
          return std::string(what) + " " + std::to_string(i) + ": its node " + std::to_string(k) +
                 " is none of this body";
    return "";
  };
  return body.m_faces.size() > 0 ? foreign("face", body.m_faces, 3) : foreign("link", body.m_links, 2);
}

}  // namespace

int index_of(const btSoftBody& body, const btSoftBody::Node* node) {
  if (body.m_nodes.size() == 0) return -1;
  // A difference of pointers into different arrays is no number of nodes.
  const auto first = reinterpret_cast<std::uintptr_t>(&body.m_nodes[0]);
  const std::uintptr_t distance = reinterpret_cast<std::uintptr_t>(node) - first;
  const std::uintptr_t index = distance / sizeof(btSoftBody::Node);
  const bool is_one = distance % sizeof(btSoftBody::Node) == 0 && index < static_cast<std::size_t>(body.m_nodes.size());
  return is_one ? static_cast<int>(index) : -1;
}

Nodes::Nodes(btSoftBody& body, Particles& particles)
    : body_(&body), checked_parts_{body.m_faces.size(), body.m_links.size()} {
  const int size = body.m_nodes.size();
  if (const std::string what = foreign_part(body); !what.empty()) throw std::invalid_argument("attach: " + what);
  particles.positions = PackedVectors::Zero(4, size);
  particles.velocities = PackedVectors::Zero(4, size);
  particles.inverse_masses.resize(size);
  written_positions_.resize(size);
  written_velocities_.resize(size);
  read_inverse_masses_.resize(size);
  for (int i = 0; i < size; ++i) {
    const btSoftBody::Node& node = body.m_nodes[i];
    check(node.m_x, i, "position");
    check(node.m_v, i, "velocity");
    if (!is_inverse_mass(node.m_im)) refuse(i, "inverse mass", Real(node.m_im), "zero (pinned) or positive and finite");
    particles.positions.col(i).head<3>() = to_vector(node.m_x);
    particles.velocities.col(i).head<3>() = to_vector(node.m_v);
    particles.inverse_masses[i] = node.m_im;
    read_inverse_masses_[i] = node.m_im;
    written_positions_[i] = node.m_x;
    written_velocities_[i] = node.m_v;
  }
}

void Nodes::reject(int node, const char* what) {
  if (rejected_.node < 0) rejected_ = {node, what};
}

NodeChanges Nodes::read(Particles& particles, Real duration) {
  if (body_->m_nodes.size() != particles.size())
    throw std::logic_error("the soft body has " + std::to_string(body_->m_nodes.size()) + " nodes, had " +
                           std::to_string(particles.size()) + " when it was attached: detach it, attach it again");
  if (const std::array<int, 2> parts{body_->m_faces.size(), body_->m_links.size()}; parts != checked_parts_) {
    if (const std::string what = foreign_part(*body_); !what.empty()) throw std::logic_error(what + ": take it away");
    checked_parts_ = parts;
  }
  NodeChanges changes;
  rejected_ = {};
  for (const LedNode& led : led_)  // of a step that was given up
    particles.velocities.col(led.node).head<3>() = led.velocity;
  led_.clear();
  for (int i = 0; i < particles.size(); ++i) {
    btSoftBody::Node& node = body_->m_nodes[i];
    // As most are, step after step.
    if (node.m_x == written_positions_[i] && node.m_v == written_velocities_[i] && node.m_im == read_inverse_masses_[i])
      continue;
    if (!is_inverse_mass(node.m_im)) {
      reject(i, "inverse mass is negative or not finite");
      node.m_im = read_inverse_masses_[i];
    }
    const btVector3 dx = node.m_x - written_positions_[i], dv = node.m_v - written_velocities_[i];
    if (!std::isfinite(dx.length2()) || !std::isfinite(dv.length2())) {
      reject(i, std::isfinite(dx.length2()) ? "velocity is not finite" : "position is not finite");
      node.m_x = written_positions_[i];
      node.m_v = written_velocities_[i];
      continue;
    }
    if (!dv.isZero()) {
      particles.velocities.col(i).head<3>() += to_vector(dv);
      written_velocities_[i] = node.m_v;
    }
    if (!dx.isZero() && node.m_im > 0) {
      particles.positions.col(i).head<3>() += to_vector(dx);
      written_positions_[i] = node.m_x;
      changes.moved = true;
    } else if (!dx.isZero()) {
      // What a node flew at before it was pinned, it is not to fly on at.
      const bool keeps_velocity = read_inverse_masses_[i] == 0 || !dv.isZero();
      const Vector3 velocity = particles.velocities.col(i).head<3>();
      led_.push_back({i, to_vector(node.m_x), keeps_velocity ? velocity : Vector3::Zero()});
    }
    if (node.m_im != read_inverse_masses_[i]) {
      changes.lighter = changes.lighter || node.m_im > read_inverse_masses_[i];
      read_inverse_masses_[i] = node.m_im;
      particles.inverse_masses[i] = node.m_im;
    }
  }
  if (!led_.empty()) lead(particles, duration, changes);
  return changes;
}

void Nodes::lead(Particles& particles, Real duration, NodeChanges& changes) {
  const std::vector<Real>& inverse_masses = particles.inverse_masses;
  const bool jump = !(duration > 0) || changes.moved ||
                    std::none_of(inverse_masses.begin(), inverse_masses.end(), [](Real im) { return im > 0; });
  for (const LedNode& led : led_) {
    auto position = particles.positions.col(led.node).head<3>();
    if (jump) {
      position = led.place;
      written_positions_[led.node] = body_->m_nodes[led.node].m_x;
      particles.velocities.col(led.node).head<3>() = led.velocity;
    } else {
      particles.velocities.col(led.node).head<3>() = (led.place - position) / duration;
    }
  }
  if (!jump) return;
  led_.clear();
  changes.moved = true;
}

void Nodes::arrive(Particles& particles, PackedVectors& start) {
  for (const auto& [node, place, velocity] : led_) {
    particles.positions.col(node).head<3>() = start.col(node).head<3>() = place;
    particles.velocities.col(node).head<3>() = velocity;
  }
  led_.clear();
}

bool Nodes::has_moved_pins() const {
  for (int i = 0; i < std::min<int>(body_->m_nodes.size(), written_positions_.size()); ++i)
    if (body_->m_nodes[i].m_im == 0 && body_->m_nodes[i].m_x != written_positions_[i]) return true;
  return false;
}

bool Nodes::read_forces(PackedVectors& forces) {
  const int size = body_->m_nodes.size();
  bool any = false;
  for (int i = 0; i < size; ++i) {
    btVector3& force = body_->m_nodes[i].m_f;
    if (force.isZero()) continue;
    if (is_finite(force)) {
      any = true;
    } else {
      reject(i, "force is not finite");
      force.setZero();
    }
  }
  if (!any && forces.size() == 0) return false;
  if (!any) {
    forces.resize(4, 0);
    return true;
  }
  forces.setZero(4, size);
  for (int i = 0; i < size; ++i) {
    forces.col(i).head<3>() = to_vector(body_->m_nodes[i].m_f);
    body_->m_nodes[i].m_f.setZero();
  }
  return true;
}

bool Nodes::can_hold(const Particles& particles) {
  btScalar sum = 0;  // zero times what is finite is zero
  for (int i = 0; i < particles.size(); ++i) {
    const btVector3 x = to_bullet(particles.positions.col(i)), v = to_bullet(particles.velocities.col(i));
    sum += btScalar(0) * (x.x() + x.y() + x.z()) + btScalar(0) * (v.x() + v.y() + v.z());
  }
  return sum == 0;
}

void Nodes::write_mean_velocities(const Particles& particles, const PackedVectors& start, Real duration,
                                  const Vector3& gravity_dv) {
  for (int i = 0; i < particles.size(); ++i) {
    const Vector3 mean = (particles.positions.col(i) - start.col(i)).head<3>() / duration;
    btSoftBody::Node& node = body_->m_nodes[i];
    node.m_x = written_positions_[i];
    node.m_v = to_bullet(Vector3(node.m_im > 0 ? mean - gravity_dv : mean));
    if (!is_finite(node.m_v)) node.m_v.setZero();
  }
}

void Nodes::remember_velocities() {
  for (int i = 0; i < body_->m_nodes.size(); ++i) {
    btSoftBody::Node& node = body_->m_nodes[i];
    node.m_vn = node.m_v;  // in implicit mode Bullet's solve starts from here
    written_velocities_[i] = node.m_v;
  }
}

void Nodes::write(const Particles& particles, Real lead) {
  for (int i = 0; i < particles.size(); ++i) {
    btSoftBody::Node& node = body_->m_nodes[i];
    written_positions_[i] = node.m_x = to_bullet(particles.positions.col(i));
    written_velocities_[i] = node.m_vn = node.m_v = to_bullet(particles.velocities.col(i));
    node.m_q = node.m_x - node.m_v * static_cast<btScalar>(lead);
  }
}

bool Nodes::read_velocity_changes(Particles& particles, Real duration) {
  bool moved = false;
  for (int i = 0; i < particles.size(); ++i) {
    btSoftBody::Node& node = body_->m_nodes[i];
    const Vector3 dv = to_vector(node.m_v - written_velocities_[i]);
    const Vector3 shift = duration * (dv + to_vector(node.m_splitv));
    if (shift.isZero(0)) continue;
    if (!shift.allFinite()) {
      reject(i, "velocity after Bullet's contacts is not finite");
      continue;
    }
    particles.velocities.col(i).head<3>() += dv;
    particles.positions.col(i).head<3>() += shift;
    moved = true;
  }
  return moved;
}

void Nodes::positions_to_velocities(Real inverse_duration) {
  for (int i = 0; i < body_->m_nodes.size(); ++i) {
    btSoftBody::Node& node = body_->m_nodes[i];
    node.m_v = written_velocities_[i] + (node.m_x - written_positions_[i]) * static_cast<btScalar>(inverse_duration);
  }
}

void Nodes::freeze() {
  for (int i = 0; i < body_->m_nodes.size(); ++i) {
    btSoftBody::Node& node = body_->m_nodes[i];
    node.m_v.setZero();
    node.m_vn.setZero();
    node.m_splitv.setZero();
    node.m_q = node.m_x;
  }
  forget_contacts();
}

void Nodes::thaw() {
  for (int i = 0; i < body_->m_nodes.size(); ++i) {
    btSoftBody::Node& node = body_->m_nodes[i];
    node.m_v = i < written_velocities_.size() ? written_velocities_[i] : btVector3(0, 0, 0);
    node.m_vn = node.m_v;
    node.m_q = node.m_x;
  }
}

void Nodes::stop() {
  for (int i = 0; i < written_velocities_.size(); ++i) written_velocities_[i].setZero();
}

void Nodes::forget_contacts() {
  for (int i = 0; i < body_->m_nodes.size(); ++i) {
    btSoftBody::Node& node = body_->m_nodes[i];
    node.m_effectiveMass_inv = btMatrix3x3::getIdentity() * node.m_im;
  }
  body_->m_rcontacts.resizeNoInitialize(0);
  body_->m_scontacts.resizeNoInitialize(0);
  body_->m_nodeRigidContacts.resizeNoInitialize(0);
  body_->m_faceRigidContacts.resizeNoInitialize(0);
  body_->m_faceNodeContacts.resizeNoInitialize(0);
  body_->m_faceNodeContactsCCD.resizeNoInitialize(0);
}

}  // namespace penalty
