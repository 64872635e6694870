// Couplings of the attached bodies: made and taken away, followed through bodies that come and go, brought into the
// step.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "identity.h"
#include "penalty/bullet/attached_bodies.h"
#include "penalty/stepping/island.h"

namespace penalty {

class HeldBodies;
struct HeldBody;
struct WorldIsland;

struct HeldPoint {
  CouplingPoint point;
  Identity name;

  // Of this step; both null: the body is not in the world, and may be gone.
  HeldBody* soft = nullptr;
  btRigidBody* rigid = nullptr;

  btCollisionObject* object() const;
};

struct HeldCoupling {
  int number;
  std::vector<HeldPoint> points;
  PotentialField field;
  Coupling stepped = {};
  std::uint64_t estimated_version = 0;
  bool is_complete = true;  // all its bodies are in the world

  bool holds(const Identity& name) const;
};

class Couplings {
 public:
  /// See AttachedBodies::couple.
  int add(const HeldBodies& bodies, const std::vector<CouplingPoint>& points, PotentialField field, Real damping_time);
  HeldCoupling& get(int number) const;
  void remove(int number);
  void remove_all_of(const btSoftBody& body);

  /// Its bodies wake in the next step: until then nobody knows whether they are alive.
  void wake(const HeldCoupling& coupling);

  /// Begins a step: finds the bodies in the world, wakes who is to be woken, drops in silence what holds a body that is
  /// gone.
  void find_bodies(const HeldBodies& bodies, std::span<btSoftBody* const> listed);

  /// Holds the bodies of couplings whose rigid body has left the world.
  void hold_bodies_of_incomplete();

  /// A body that is held holds those that it is coupled to.
  void hold_coupled();

  /// Brings the bodies of each coupling that is awake into one island. A coupling to a soft body that rests, or is not
  /// in the world, rests.
  void join(std::vector<WorldIsland>& islands, const class RigidBodies& rigid_bodies) const;

  std::span<const std::unique_ptr<HeldCoupling>> all() const { return couplings_; }

 private:
  std::vector<std::unique_ptr<HeldCoupling>> couplings_;
  std::vector<Identity> waking_;
  int next_number_ = 0;
};

}  // namespace penalty
