// A random sequence of calls in Bullet worlds, and what must hold after each of them.
#pragma once
#include "bullet/simulation.h"  // first: see there

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "fuzz/chance.h"
#include "fuzz/finding.h"
#include "fuzz/random_field.h"

namespace penalty::testing {

/// Everything that happens follows from the seed: the manner, one or two worlds and of which kind, bodies, rigid bodies
/// and calls. Throws Finding when a promise is broken:
///
/// - no exception leaves a step, and none but std::invalid_argument (of one line; after misuse std::logic_error) any
/// other
///   call; in the legal manner none;
/// - particles are finite, always; nodes are finite after a step into which nothing went that was not;
/// - nodes are where particles are;
/// - what is free keeps its linear momentum but for gravity and forces, and its angular momentum without them;
/// - once the application has mended what it did wrong, every ordinary body is stepped again, and falls.
class Sequence {
 public:
  /// `log`: every call is printed on standard error before it is made.
  explicit Sequence(std::uint64_t start, bool log = false);
  ~Sequence();
  Sequence(const Sequence&) = delete;
  Sequence& operator=(const Sequence&) = delete;

  void run();

 private:
  struct Body {
    Simulation* home;
    TetMesh mesh;
    std::unique_ptr<btSoftBody> outside;  // while it is in no world
    btSoftBody* soft = nullptr;
    bool attached = false;
    bool conserves = true;  // its fields keep momentum, and it has no drag
    bool ordinary = true;   // fields, options and nodes are such that it must recover from anything else
    bool tangled = false;   // nodes in confusion, or far apart: a step from there may come to no end
    bool stopped = false;   // by the application, through an activation state, or by Bullet, because it was huge

    bool in_world() const { return !outside; }
  };
  struct RigidObject {
    Simulation* home;
    btRigidBody* body;
  };
  struct Joint {
    Simulation* home;
    int number;
    std::vector<const btSoftBody*> soft_bodies;
    std::vector<const btRigidBody*> rigid_bodies;
  };
  struct RigidJoint {
    Simulation* home;
    std::unique_ptr<btTypedConstraint> constraint;
  };
  struct Books {
    Vector3 linear = Vector3::Zero(), angular = Vector3::Zero();
    Real size = 0;  // sum of the magnitudes [kg m/s]
  };
  struct Operation {
    const char* name;
    int weight;
    void (Sequence::*act)();
    bool in_callback;  // Bullet stands it within a step: what takes bodies out of the world it does not
  };
  static const std::vector<Operation>& operations();

  // What the application does.
  void make_body();
  void attach_again();
  void attach_wrong_size();
  void detach();
  void delete_body();
  void leave_or_enter_world();
  void edit();
  void couple();
  void uncouple();
  void edit_coupling();
  void change_anchors();
  void add_rigid_body();
  void remove_rigid_body();
  void change_rigid_body();
  void add_rigid_joint();
  void remove_rigid_joint();
  void change_masses();
  void move_nodes();
  void add_forces();
  void change_gravity();
  void change_margin();
  void change_activation();
  void look_at_everything();
  void switch_fault();
  void switch_callback();
  void append_node();
  void step();
  void step_oddly();

  // Around it.
  bool legal() const { return chance_.manner == Manner::legal; }
  Body* pick_body();
  Body* pick_attached();
  RandomField field_for(Body& body);
  AttachOptions random_options(Body& body);
  static bool is_torn_apart(const Body& body);
  void attach(Body& body, RandomField field, const AttachOptions& options);
  void forget_joints(const Body& body);
  void uncouple_all_of(const Body& body);
  void remove_rigid_joints(const std::function<bool(const RigidJoint&)>& which);
  void one_operation(bool in_callback);
  bool attempt(const char* call, const std::function<void()>& act);  // false: it was refused
  void say(const std::string& text) const;
  void call_back(Simulation& home, bool on);
  static void on_tick(btDynamicsWorld* world, btScalar duration);

  // What must hold.
  void advance(Simulation& home, Real duration, int substeps, Real fixed);
  bool is_sound(const Body& body) const;  // all that goes into a step is finite
  void spread_tangles(const Simulation& home);
  bool keeps_books(const Simulation& home) const;
  Books books(const Simulation& home) const;
  void check_nodes(const Body& body, bool was_sound, bool stepped) const;
  void mend();
  void check_that_all_fall();

  Chance chance_;
  bool log_;
  UserFault fault_;
  std::vector<std::unique_ptr<Simulation>> worlds_;
  std::vector<std::unique_ptr<Body>> bodies_;
  std::vector<RigidObject> rigid_;
  std::vector<Joint> joints_;
  std::vector<RigidJoint> rigid_joints_;
  std::vector<const Simulation*> called_back_;
  int depth_ = 0;     // of steps within steps
  int substeps_ = 0;  // that were taken so far, of all bodies
  std::string found_in_callback_;
};

}  // namespace penalty::testing
