// What must hold after each step, and at the end.
#include <algorithm>
#include <cmath>

#include "fuzz/sequence.h"

namespace penalty::testing {
namespace {

bool is_finite(const btVector3& v) { return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z()); }

bool nodes_are_finite(const btSoftBody& body) {
  for (int i = 0; i < body.m_nodes.size(); ++i)
    if (!is_finite(body.m_nodes[i].m_x) || !is_finite(body.m_nodes[i].m_v)) return false;
  return true;
}

std::string text(const Vector3& v) {
  return "(" + std::to_string(v.x()) + ", " + std::to_string(v.y()) + ", " + std::to_string(v.z()) + ")";
}

}  // namespace

bool Sequence::is_sound(const Body& body) const {
  if (std::find(called_back_.begin(), called_back_.end(), body.home) != called_back_.end())
    return false;  // it may write
  if (!nodes_are_finite(*body.soft) || !std::isfinite(body.soft->getCollisionShape()->getMargin())) return false;
  if (!is_finite(body.home->info().m_gravity) || fault_.throws || fault_.gives_nan) return false;
  for (int i = 0; i < body.soft->m_nodes.size(); ++i)
    if (!is_finite(body.soft->m_nodes[i].m_f) || !std::isfinite(body.soft->m_nodes[i].m_im)) return false;
  return true;
}

// What is coupled, or touches the same rigid body, is stepped together.
void Sequence::spread_tangles(const Simulation& home) {
  const bool any = std::any_of(bodies_.begin(), bodies_.end(),
                               [&home](const auto& body) { return body->home == &home && body->tangled; });
  for (const auto& body : bodies_) body->tangled = body->tangled || (any && body->home == &home);
}

bool Sequence::keeps_books(const Simulation& home) const {
  if (!legal() || std::find(called_back_.begin(), called_back_.end(), &home) != called_back_.end()) return false;
  for (const RigidObject& rigid : rigid_)
    if (rigid.home == &home) return false;
  for (const auto& body : bodies_) {
    if (body->home != &home || !body->attached || !body->in_world()) continue;
    if (!body->conserves || body->stopped || body->tangled) return false;
    if (body->soft->m_anchors.size() + body->soft->m_deformableAnchors.size() > 0) return false;  // of what is gone
    for (int i = 0; i < body->soft->m_nodes.size(); ++i)
      if (!(body->soft->m_nodes[i].m_im > 0)) return false;
  }
  return true;
}

Sequence::Books Sequence::books(const Simulation& home) const {
  Books sum;
  for (const auto& body : bodies_) {
    if (body->home != &home || !body->attached || !body->in_world()) continue;
    const Particles& particles = body->home->penalty().particles(*body->soft);
    for (int i = 0; i < particles.size(); ++i) {
      const Vector3 x = particles.positions.col(i).head<3>(), v = particles.velocities.col(i).head<3>();
      const Real mass = 1 / particles.inverse_masses[static_cast<std::size_t>(i)];
      sum.linear += mass * v;
      sum.angular += mass * x.cross(v);
      sum.size += mass * (1 + v.norm()) * (1 + x.norm());
    }
  }
  return sum;
}

void Sequence::advance(Simulation& home, Real duration, int substeps, Real fixed) {
  const auto dt = static_cast<btScalar>(duration);
  say("  step of " + std::to_string(duration) + " s, substeps " + std::to_string(substeps));
  const bool booked = substeps == 0 && depth_ == 0 && keeps_books(home);
  Vector3 impulse = Vector3::Zero();
  bool turned = false;  // gravity or a force has a torque
  std::vector<const Body*> sound;
  for (const auto& body : bodies_) {
    if (body->home != &home || !body->attached) continue;
    if (is_sound(*body)) sound.push_back(body.get());
    if (!booked || !body->in_world()) continue;
    home.penalty().synchronize(*body->soft);
    for (int i = 0; i < body->soft->m_nodes.size(); ++i) {
      const btSoftBody::Node& node = body->soft->m_nodes[i];
      const Vector3 force = to_vector(node.m_f) + to_vector(home.info().m_gravity) / Real(node.m_im);
      impulse += Real(dt) * force;
      turned = turned || !force.isZero();
    }
  }
  const Books before = booked ? books(home) : Books{};

  ++depth_;
  try {
    home.world().stepSimulation(dt, substeps, static_cast<btScalar>(fixed));
  } catch (const std::exception& error) {
    --depth_;
    throw Finding(std::string("an exception left the step: ") + error.what());
  } catch (...) {
    --depth_;
    throw Finding("something that is no std::exception left the step");
  }
  --depth_;
  if (!found_in_callback_.empty()) throw Finding("in a callback: " + found_in_callback_);

  spread_tangles(home);
  for (const auto& body : bodies_)
    if (body->home == &home && body->attached) {
      substeps_ += body->home->penalty().report(*body->soft).substeps;
      check_nodes(*body, std::find(sound.begin(), sound.end(), body.get()) != sound.end() && std::isfinite(dt), dt > 0);
    }
  if (!booked || !called_back_.empty()) return;
  const Books after = books(home);
  const Real tolerance = 1e-8 * (before.size + after.size + impulse.norm());
  require(
      (after.linear - before.linear - impulse).norm() <= tolerance,
      "momentum was " + text(before.linear) + ", the impulse " + text(impulse) + ", momentum is " + text(after.linear));
  require(turned || (after.angular - before.angular).norm() <= tolerance,
          "angular momentum was " + text(before.angular) + ", is " + text(after.angular));
}

void Sequence::check_nodes(const Body& body, bool was_sound, bool stepped) const {
  const Particles& particles = body.home->penalty().particles(*body.soft);
  require(particles.positions.allFinite() && particles.velocities.allFinite(),
          std::string("particles are not finite, ") +
              (body.home->penalty().report(*body.soft).finite ? "the report says they are" : "as reported") +
              (was_sound ? ", although all that went in was" : ""));
  require(!was_sound || nodes_are_finite(*body.soft), "nodes are not finite, although all that went in was");
  if (!legal()) return;
  require(body.tangled || body.home->penalty().report(*body.soft).finite,
          "a legal step is reported as not finite: " + body.home->penalty().report(*body.soft).problem);
  if (!stepped || !body.in_world() || body.stopped || depth_ > 0 || !called_back_.empty()) return;
  for (int i = 0; i < particles.size(); ++i) {
    const Vector3 x = particles.positions.col(i).head<3>(), node = to_vector(body.soft->m_nodes[i].m_x);
    const Real size = 1 + x.norm() + particles.velocities.col(i).head<3>().norm();
    require((x - node).norm() <= limit(1e-12, 1e-5) * size,
            "node " + std::to_string(i) + " is at " + text(node) + ", its particle at " + text(x));
  }
}

void Sequence::look_at_everything() {
  for (const auto& body : bodies_) {
    if (!body->attached) continue;
    AttachedBodies& solver = body->home->penalty();
    attempt("ledger", [&] { solver.ledger(*body->soft); });
    attempt("forces", [&] { solver.forces(*body->soft); });
    attempt("flows", [&] { solver.flows(*body->soft).received(); });
    attempt("refresh", [&] { solver.refresh(*body->soft); });
    attempt("synchronize", [&] { solver.synchronize(*body->soft); });
    attempt("report", [&] { solver.report(*body->soft); });
    attempt("contacts", [&] {
      for (const BodyContact& contact : solver.contacts(*body->soft))
        require(contact.impulse.allFinite() && contact.point.allFinite(), "a contact is not finite");
    });
  }
  for (const RigidObject& rigid : rigid_)
    attempt("contact_force", [&] { rigid.home->penalty().contact_force(*rigid.body); });
  for (const Joint& joint : joints_) {
    attempt("coupling_energy", [&] { joint.home->penalty().coupling_energy(joint.number); });
    attempt("coupling_field", [&] { joint.home->penalty().coupling_field(joint.number); });
  }
}

void Sequence::mend() {
  say("mending");
  for (const auto& home : worlds_) {
    call_back(*home, false);
    home->set_gravity({0, -9.81, 0});
  }
  fault_ = {};
  for (const Joint& joint : joints_) joint.home->penalty().uncouple(joint.number);
  joints_.clear();
  remove_rigid_joints([](const RigidJoint&) { return true; });
  for (const RigidObject& rigid : rigid_) rigid.home->remove(*rigid.body);
  rigid_.clear();
  for (const auto& body : bodies_) {
    btSoftBody& soft = *body->soft;
    soft.m_anchors.clear();
    soft.m_deformableAnchors.clear();
    soft.getCollisionShape()->setMargin(btScalar(0.02));
    // All lie in one place now, and would meet.
    soft.setCollisionFlags(soft.getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
    for (int i = 0; i < std::min(soft.m_nodes.size(), static_cast<int>(body->mesh.vertices.cols())); ++i) {
      btSoftBody::Node& node = soft.m_nodes[i];
      node.m_x = to_bullet(body->mesh.vertices.col(i));
      node.m_v.setZero();
      node.m_f.setZero();
      soft.setMass(i, btScalar(0.1));
    }
    if (body->stopped) soft.forceActivationState(DISABLE_DEACTIVATION);
    body->stopped = body->tangled = false;
    if (!body->attached) continue;
    // Of what went off that far a difference in single precision does not bring it back.
    const Particles& particles = body->home->penalty().particles(soft);
    const Real far = std::max(particles.positions.cwiseAbs().maxCoeff(), particles.velocities.cwiseAbs().maxCoeff());
    body->ordinary = body->ordinary && !(far > 1e4 && std::isfinite(far));
  }
}

void Sequence::check_that_all_fall() {
  constexpr int steps = 6;
  for (const auto& home : worlds_)
    for (int k = 0; k < steps; ++k) advance(*home, 1.0 / 60, 0, 1.0 / 60);
  for (const auto& body : bodies_) {
    if (!body->attached || !body->in_world() || !body->ordinary) continue;
    const Particles& particles = body->home->penalty().particles(*body->soft);
    const StepReport& report = body->home->penalty().report(*body->soft);
    require(report.finite, "a mended body is still reported as not finite, from particle " +
                               std::to_string(report.first_bad_particle) + " on");
    require(nodes_are_finite(*body->soft), "the nodes of a mended body are not finite");
    if (!body->conserves) continue;  // held by what it is tied to
    const Real speed = -particles.velocities.row(1).mean();
    require(speed > 0.2, "a mended body does not fall: its speed is " + std::to_string(speed) + " m/s after " +
                             std::to_string(steps) + " steps");
  }
}

}  // namespace penalty::testing
