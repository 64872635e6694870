// The soft bodies of one solver, known by their serial numbers.
#pragma once
#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "body_contacts.h"
#include "identity.h"
#include "mesh_sides.h"
#include "nodes.h"
#include "penalty/bullet/attached_bodies.h"
#include "penalty/contact/box.h"
#include "penalty/contact/contact_surface.h"
#include "penalty/stepping/island.h"
#include "torn_faces.h"

namespace penalty {

/// What a step made of a body.
enum class StepOutcome {
  none,     // not in the world, asleep, or no step was made
  stepped,  // as it should be
  held,     // it stays where it is, and the report says why
};

/// One of Bullet's anchors, of this step.
struct HeldAnchor {
  int node;
  btCollisionObject* object;
  Vector3 local;  // where it is held, in the frame of the object [m]
  Real influence;
};

struct HeldBody {
  HeldBody(btSoftBody& soft_body, PotentialField potential_field, const AttachOptions& attach_options);

  btSoftBody* body;  // to be followed only where it is known to be alive: given by the caller, or listed by the world
  SerialNumber serial;
  std::uint64_t order = 0;  // in which the bodies of the solver were attached; no two have the same
  PotentialField field;
  AttachOptions options;
  Real largest_margin;  // that the size of the body allows [m]
  SteppedBody stepped;
  Nodes nodes;
  bool stale = true;                        // the stability estimate is to be made anew
  std::uint64_t estimated_version = 0;      // of the field's stiffness
  std::shared_ptr<ContactSurface> surface;  // made when it is needed first,
  std::array<int, 2> surface_size{};        // of so many faces and links
  MeshSides mesh_sides;                     // of its points
  TornFaces torn_faces;
  std::shared_ptr<BodyContacts> contacts = std::make_shared<BodyContacts>();  // who is told of them may detach the body
  int listed = 0;  // step in which the world last had the body; 0: none so far

  // Of this step.
  StepOutcome outcome = StepOutcome::none;
  int switched_off = 0;            // of the flags in m_cfg.collisions, within a world step
  int activation_state = 0;        // to be restored
  const char* left_out = nullptr;  // says what of what it touches is not finite
  std::vector<HeldAnchor> anchors;
  int number = 0;       // of the body in its island
  PackedVectors start;  // positions before the step, to go back to [m]
  Box box;              // of the particles before the step [m],
  Real fastest2 = 0;    // and the square of their largest speed [m²/s²]: see `measure`

  Identity identity() const { return {body, serial}; }

  /// The distance that it keeps from others [m].
  Real margin() const;

  /// Adds what others changed to the state; pinned nodes that were moved go there in `duration` [s], see Nodes::read.
  void read_nodes(Real duration = 0);

  /// Lets the faces go that what broke in the step held, and their contact with them.
  void let_torn_faces_go();

  /// What is not attached any more has all its faces.
  void give_faces_back();

  /// Finds the box and the largest speed, once for all who ask where the body may come in the step.
  void measure();

  /// The step failed: the body stays where it was at the start, and `problem` goes into the report. `stopped`: at rest;
  /// else it keeps its velocities. Never throws.
  void hold(const char* problem, bool stopped) noexcept;
};

/// Bodies by address; an address whose serial number is not the one that was noted belongs to somebody else.
class HeldBodies {
 public:
  /// Null if the body, which is alive, is not attached.
  HeldBody* find(const btSoftBody& body) const;
  HeldBody& get(const btSoftBody& body) const;  // throws std::invalid_argument

  /// Null if nobody of that name is held; a body that was deleted unnoticed may still be.
  HeldBody* find(const Identity& name) const;

  HeldBody& add(btSoftBody& body, PotentialField field, const AttachOptions& options);
  void remove(const btSoftBody& body) { bodies_.erase(&body); }

  /// Begins a step: notes which bodies are in the world, and drops the entries at whose address a listed body is
  /// another.
  void list(std::span<btSoftBody* const> bodies);

  bool is_listed(const HeldBody& held) const { return held.listed == step_; }

  /// The bodies that were in the world in the last step, in the order in which they were attached. They may be deleted.
  std::vector<const HeldBody*> all_listed() const;

  /// Whether the body is held, and in the world as of the last step or not yet there.
  bool is_there(const Identity& name) const;

 private:
  std::unordered_map<const btCollisionObject*, std::unique_ptr<HeldBody>> bodies_;
  int step_ = 0;
  std::uint64_t attached_ = 0;
};

}  // namespace penalty
