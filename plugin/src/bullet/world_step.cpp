#include "world_step.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "body_anchors.h"
#include "body_settings.h"
#include "convert.h"
#include "obstacles.h"
#include "sleeping.h"
#include "world_objects.h"

namespace penalty {
namespace {

// Calls; if that throws, `failed` hears what was said.
template <class Call, class Failed>
void shield(const Call& call, const Failed& failed) noexcept {
  try {
    call();
  } catch (const std::exception& error) {
    failed(error.what());
  } catch (...) {
    failed("something was thrown that is no std::exception");
  }
}

void set_problem(StepReport& report, const char* what) noexcept {
  shield([&] { report.problem = what; }, [](const char*) {});
}

void set_problem(StepReport& report, const char* what, int particle, const char* then) noexcept {
  shield([&] { report.problem = what + std::to_string(particle) + then; },
         [&](const char*) { report.problem = "not finite"; });
}

}  // namespace

void report_rejected(HeldBody& held) noexcept {
  const RejectedNode& rejected = held.nodes.rejected();
  if (rejected.node < 0) return;
  StepReport& report = held.stepped.report;
  report.finite = false;
  report.first_bad_particle = rejected.node;
  shield(
      [&] {
        report.problem = "node " + std::to_string(rejected.node) + ": its " + rejected.what + ", and was set back";
      },
      [&](const char*) { report.problem = "not finite"; });
}

bool stays_in_range(HeldBody& held) noexcept {
  if (Nodes::can_hold(held.stepped.particles)) return true;
  held.hold("it went where Bullet's precision has no numbers", true);
  held.stepped.report.finite = false;
  return false;
}

std::span<HeldBody* const> AttachedBodies::World::step(std::span<btSoftBody* const> listed, Real duration,
                                                       bool gravity_applied) noexcept {
  joints.show();  // what a step before did not come to show
  stepped_.clear();
  to_be_told_of_.clear();
  islands_.clear();
  bodies->list(listed);
  if (!(duration > 0) || !std::isfinite(duration)) {
    hold_all(listed, "the time step is not positive and finite: no step was made", std::isfinite(duration));
    return {};
  }
  shield(
      [&] {
        rigid_bodies_.begin_step(duration, gravity_applied);
        rigid_surfaces_.begin_step();
        step_all(listed, duration);
      },
      [&](const char* problem) {
        islands_.clear();
        stepped_.clear();
        hold_all(listed, problem, true);
      });
  return stepped_;
}

// What the application changed is read all the same.
void AttachedBodies::World::hold_all(std::span<btSoftBody* const> listed, const char* problem, bool finite) noexcept {
  for (btSoftBody* body : listed) {
    HeldBody* held = bodies->find(*body);
    if (!held || !body->isActive()) continue;
    shield(
        [&] {
          held->read_nodes();
          held->hold(problem, false);
          held->stepped.report.finite = finite;
        },
        [&](const char* other) { held->hold(other, true); });
  }
}

void AttachedBodies::World::step_all(std::span<btSoftBody* const> listed, Real duration) {
  stepped_.reserve(listed.size());
  if (contact_callback) to_be_told_of_.reserve(listed.size());
  for (btSoftBody* body : listed)
    if (const HeldBody* held = bodies->find(*body)) {
      broadphase_ = body->getWorldInfo()->m_broadphase;  // which attach asked for
      if (!body->isActive() && held->nodes.has_moved_pins()) body->activate(true);
      wake_if_hit(*body);
    }
  Surfaces::wake_touched(*bodies, listed, duration);
  couplings.find_bodies(*bodies, listed);
  keep_awake_together(couplings, joints, surfaces_, *bodies, listed);
  couplings.hold_bodies_of_incomplete();
  for (btSoftBody* body : listed) {
    HeldBody* held = bodies->find(*body);
    if (!held || !body->isActive() || held->outcome == StepOutcome::held) continue;
    shield([&] { prepare(*held, duration); }, [&](const char* problem) { held->hold(problem, true); });
  }
  couplings.hold_coupled();
  join_islands(duration);
  for (WorldIsland& island : islands_) {
    impacts_.add(island);
    advance(island, duration);
  }
  rigid_manifolds_.remember(islands_);
  impacts_.remember(islands_);
  joints.remember(islands_, duration);
  for (btSoftBody* body : listed)
    if (HeldBody* held = bodies->find(*body); held && held->outcome == StepOutcome::stepped) {
      stepped_.push_back(held);
      shield([&] { held->let_torn_faces_go(); }, [&](const char* what) { set_problem(held->stepped.report, what); });
      if (contact_callback && held->contacts->are_news()) to_be_told_of_.push_back(held->identity());
    }
}

// Reads what the world says of the body and begins an island with it.
void AttachedBodies::World::prepare(HeldBody& held, Real duration) {
  SteppedBody& stepped = held.stepped;
  btSoftBody& body = *held.body;
  held.read_nodes(duration);
  const char* problem = not_finite_setting(body);
  if (!problem) add_forces_of_settings(body, duration);
  if (held.nodes.read_forces(stepped.external_forces)) stepped.positions_changed();
  if (problem) {
    held.hold(problem, false);
    stepped.report.finite = false;
    return;
  }
  stepped.gravity = to_vector(body.getWorldInfo()->m_gravity) * Real(body.m_gravityFactor);
  if (held.stale || held.estimated_version != held.field.stiffness_version()) {
    estimate_stability(stepped);
    held.stale = false;
    held.estimated_version = held.field.stiffness_version();
  }
  held.measure();
  held.anchors.clear();
  if (has_anchors(body)) {
    if (const char* trouble = read_anchors(held, WorldObjects(broadphase_))) return held.hold(trouble, true);
  }
  WorldIsland island;
  island.held.push_back(&held);
  const bool friction_is_finite = detect_contacts(held, island, rigid_bodies_, rigid_surfaces_, duration);
  held.left_out =
      friction_is_finite ? nullptr : "the friction of an object that it touches is not finite, and was left out";
  add_anchors(held, rigid_bodies_, island);
  wait_for_carried(held, island);
  islands_.push_back(std::move(island));
}

// Bodies that are coupled, may touch each other, or touch the same movable rigid body, or one that touches it, are stepped
// together.
void AttachedBodies::World::join_islands(Real duration) {
  std::erase_if(islands_, [](const WorldIsland& island) { return island.held.front()->outcome == StepOutcome::held; });
  couplings.join(islands_, rigid_bodies_);
  std::erase_if(islands_, [](const WorldIsland& island) { return island.held.empty(); });
  surfaces_.join(islands_, *bodies, duration);
  if (!islands_.empty())
    rigid_manifolds_.add(islands_, *islands_.front().held.front()->body->getWorldInfo(), rigid_bodies_, joints,
                         duration);
  for (std::size_t i = 0; i < islands_.size(); ++i)
    for (std::size_t j = i + 1; j < islands_.size();)
      if (!islands_[j].held.empty() && islands_[i].shares_a_rigid_body_with(islands_[j])) {
        islands_[i].absorb(islands_[j]);
        j = i + 1;  // what came in may touch more
      } else {
        ++j;
      }
  std::erase_if(islands_, [](const WorldIsland& island) { return island.held.empty(); });
}

void AttachedBodies::World::advance(WorldIsland& island, Real duration) noexcept {
  const auto hold_island = [&](const char* problem) {
    for (HeldBody* held : island.held) held->hold(problem, true);
    island.touched.clear();
    island.joints.clear();
  };
  shield(
      [&] {
        Links::couple(island.touched);
        island.advance(duration, island_);
        rigid_bodies_.hand_back(island.touched, island_.rigid_bodies);
      },
      hold_island);
  for (HeldBody* held : island.held) {
    if (held->outcome == StepOutcome::held) continue;
    held->outcome = StepOutcome::stepped;
    held->nodes.arrive(held->stepped.particles, held->start);
    StepReport& report = held->stepped.report;
    if (!report.finite) {
      held->stepped.positions_changed();
      set_problem(report, "the step did not stay finite and was undone; look at particle ", report.first_bad_particle,
                  "");
    } else if (held->left_out) {
      set_problem(report, held->left_out);
    }
    report_rejected(*held);
  }
}

void AttachedBodies::World::read_solved(HeldBody& held) noexcept {
  shield([&] { held.read_nodes(); }, [&](const char* problem) { held.hold(problem, true); });
  report_rejected(held);
}

void AttachedBodies::World::freeze_held(std::span<btSoftBody* const> listed) const noexcept {
  for (btSoftBody* body : listed)
    if (HeldBody* held = bodies->find(*body); held && held->outcome == StepOutcome::held) held->nodes.freeze();
}

void AttachedBodies::World::thaw_held(std::span<btSoftBody* const> listed) const noexcept {
  for (btSoftBody* body : listed)
    if (HeldBody* held = bodies->find(*body); held && held->outcome == StepOutcome::held) held->nodes.thaw();
}

// Any call may detach bodies, delete them, and set another callback.
void AttachedBodies::World::tell_contacts() noexcept {
  const auto is_in_world = [this](const HeldBody& held) {
    return WorldObjects(broadphase_, held.box).contain(held.identity()) ||
           WorldObjects(broadphase_).contain(held.identity());
  };
  const auto tell = [&](const Identity& name) {
    const HeldBody* held = bodies->find(name);
    const auto callback = contact_callback;
    if (!held || held->outcome != StepOutcome::stepped || !callback || !*callback || !is_in_world(*held)) return;
    const auto contacts = held->contacts;
    (*callback)(*held->body, contacts->of(*held->body));
  };
  for (const Identity& name : std::exchange(to_be_told_of_, {}))
    shield([&] { tell(name); },
           [&](const char* said) {
             HeldBody* held = bodies->find(name);
             if (!held) return;
             shield([&] { held->stepped.report.problem = std::string("the contact callback threw: ") + said; },
                    [](const char*) {});
           });
}

void AttachedBodies::World::correct_rigid_bodies(Real duration) noexcept {
  shield(
      [&] {
        for (const WorldIsland& island : islands_) rigid_bodies_.correct(island.touched, *broadphase_, duration);
      },
      [](const char*) {});
  islands_.clear();
}

}  // namespace penalty
