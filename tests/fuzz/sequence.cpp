#include "fuzz/sequence.h"

#include <algorithm>
#include <cmath>
#include <iostream>

namespace penalty::testing {
namespace {

Real extent(const Eigen::Matrix3Xd& points) {
  return (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).norm();
}

}  // namespace

const std::vector<Sequence::Operation>& Sequence::operations() {
  static const std::vector<Operation> all{{"make body", 3, &Sequence::make_body, false},
                                          {"attach again", 2, &Sequence::attach_again, true},
                                          {"attach a field of another size", 1, &Sequence::attach_wrong_size, true},
                                          {"detach", 1, &Sequence::detach, false},
                                          {"delete body", 1, &Sequence::delete_body, false},
                                          {"leave or enter world", 1, &Sequence::leave_or_enter_world, false},
                                          {"edit", 4, &Sequence::edit, true},
                                          {"couple", 3, &Sequence::couple, true},
                                          {"uncouple", 1, &Sequence::uncouple, true},
                                          {"edit coupling", 1, &Sequence::edit_coupling, true},
                                          {"change anchors", 3, &Sequence::change_anchors, true},
                                          {"add rigid body", 2, &Sequence::add_rigid_body, false},
                                          {"remove rigid body", 1, &Sequence::remove_rigid_body, false},
                                          {"change rigid body", 1, &Sequence::change_rigid_body, true},
                                          {"add rigid joint", 2, &Sequence::add_rigid_joint, false},
                                          {"remove rigid joint", 1, &Sequence::remove_rigid_joint, false},
                                          {"change masses", 2, &Sequence::change_masses, true},
                                          {"move nodes", 3, &Sequence::move_nodes, true},
                                          {"add forces", 2, &Sequence::add_forces, true},
                                          {"change gravity", 1, &Sequence::change_gravity, true},
                                          {"change margin", 1, &Sequence::change_margin, true},
                                          {"change activation", 1, &Sequence::change_activation, true},
                                          {"look at everything", 1, &Sequence::look_at_everything, true},
                                          {"switch fault", 1, &Sequence::switch_fault, true},
                                          {"switch callback", 1, &Sequence::switch_callback, false},
                                          {"append node", 1, &Sequence::append_node, false},
                                          {"step", 12, &Sequence::step, true},
                                          {"step oddly", 2, &Sequence::step_oddly, true}};
  return all;
}

Sequence::Sequence(std::uint64_t start, bool log) : chance_(start), log_(log) {}

Sequence::~Sequence() {
  remove_rigid_joints([](const RigidJoint&) { return true; });
}

void Sequence::run() {
  const int manner = chance_.index(4);
  chance_.manner = manner < 2 ? Manner::legal : manner == 2 ? Manner::extreme : Manner::misuse;
  for (int left = chance_.one_in(6) ? 2 : 1; left > 0; --left) {
    const WorldKind kind = chance_.one_in(2) ? WorldKind::classic : WorldKind::deformable;
    worlds_.push_back(std::make_unique<Simulation>(kind));
    worlds_.back()->set_gravity(chance_.one_in(3) ? Vector3(0, 0, 0) : Vector3(0, -9.81, 0));
    worlds_.back()->world().setWorldUserInfo(this);
    say("world: " + world_name(kind));
  }
  make_body();
  make_body();
  constexpr int enough = 10000;  // substeps: few sequences would take most of the time
  for (int left = 8 + chance_.index(25); left > 0 && substeps_ < enough; --left) one_operation(false);
  mend();
  check_that_all_fall();

  // Taken apart in any order.
  const int order = chance_.index(3);
  if (order == 0)
    for (const auto& body : bodies_)
      if (body->attached) body->home->penalty().detach(*body->soft);
  if (order == 1)
    for (const auto& body : bodies_)
      if (body->in_world()) body->outside = body->home->take_out(*body->soft);
  if (order < 2) bodies_.clear();
}

void Sequence::one_operation(bool in_callback) {
  const auto& all = operations();
  int sum = 0;
  for (const Operation& operation : all) sum += operation.weight;
  int drawn = chance_.index(sum);
  const Operation* operation = all.data();
  while (drawn >= operation->weight) drawn -= (operation++)->weight;
  if (in_callback && !operation->in_callback) return;
  say(std::string(in_callback ? "in a callback: " : "") + operation->name);
  (this->*operation->act)();
}

bool Sequence::attempt(const char* call, const std::function<void()>& act) {
  try {
    act();
    return true;
  } catch (const Finding&) {
    throw;
  } catch (const std::logic_error& error) {
    const std::string what = error.what();
    say("  refused: " + what);
    require(!legal(), std::string(call) + " was refused: " + what);
    require(chance_.manner == Manner::misuse || dynamic_cast<const std::invalid_argument*>(&error),
            std::string(call) + " threw what no header promises: " + what);
    require(what.find_first_of("\r\n") == std::string::npos && !what.empty(), "a message of several lines: " + what);
  } catch (const UserError&) {
    require(fault_.throws, std::string(call) + ": the user's constraint threw when it should not");
  } catch (const std::exception& error) {
    throw Finding(std::string(call) + " threw what no header promises: " + error.what());
  }
  return false;
}

void Sequence::say(const std::string& text) const {
  if (log_) std::cerr << text << '\n';
}

Sequence::Body* Sequence::pick_body() { return bodies_.empty() ? nullptr : chance_.pick(bodies_).get(); }

Sequence::Body* Sequence::pick_attached() {
  Body* body = pick_body();
  return body && body->attached ? body : nullptr;
}

void Sequence::forget_joints(const Body& body) {
  std::erase_if(joints_, [&](const Joint& joint) {
    return std::find(joint.soft_bodies.begin(), joint.soft_bodies.end(), body.soft) != joint.soft_bodies.end();
  });
}

void Sequence::uncouple_all_of(const Body& body) {
  for (const Joint& joint : joints_)
    if (std::find(joint.soft_bodies.begin(), joint.soft_bodies.end(), body.soft) != joint.soft_bodies.end())
      joint.home->penalty().uncouple(joint.number);
  forget_joints(body);
}

RandomField Sequence::field_for(Body& body) {
  const int odd_numbers = chance_.odd_numbers();
  RandomField made = random_field(chance_, body.mesh, fault_);
  body.ordinary = body.ordinary && chance_.odd_numbers() == odd_numbers;
  body.conserves = body.conserves && made.keeps_momentum;
  if (!legal()) body.ordinary = body.ordinary && made.keeps_momentum;  // no faulty constraint
  return made;
}

AttachOptions Sequence::random_options(Body& body) {
  AttachOptions options;
  StepOptions& step = options.step;
  if (!legal()) step.max_substeps = 300;  // so that no sequence takes long
  if (chance_.one_in(2)) return options;
  step.integrator = static_cast<Integrator>(chance_.index(3));
  step.damping_time = chance_.number(0, 0.01);
  if (chance_.one_in(4)) step.drag = chance_.number(0, 1);
  if (chance_.one_in(4)) step.substeps = legal() ? 1 + chance_.index(50) : chance_.index(60) - 5;
  if (chance_.one_in(4)) step.unfold = false;
  if (chance_.one_in(4)) {
    step.safety = chance_.number(0.1, 1);
    step.contact_safety = chance_.number(0.1, 1);
    step.energy_tolerance = chance_.number(0, 0.1);
    step.contact_slop = chance_.number(0, 0.01);
    step.implicit_order = legal() ? 1 + chance_.index(2) : chance_.index(4);
    step.newton_iterations = legal() ? 1 + chance_.index(10) : chance_.index(12) - 1;
    step.newton_tolerance = chance_.number(1e-6, 0.1);
  }
  if (chance_.one_in(6)) {
    WeightedPoint point = WeightedPoint::at_particle(chance_.index(static_cast<int>(body.mesh.vertices.cols())));
    if (!legal() && chance_.one_in(3)) point.weights[0] = chance_.anything();
    options.contact_points = {point};
  }
  if (chance_.one_in(4)) options.self_contact = chance_.one_in(2);
  if (chance_.one_in(8)) {
    for (int k = 0; k < 4; ++k)
      options.surface.points.push_back(
          WeightedPoint::at_particle(chance_.index(static_cast<int>(body.mesh.vertices.cols()))));
    options.surface.triangles = {{0, 1, 2}, {0, 3, legal() ? 1 : chance_.index(6) - 1}};
  }
  if (step.drag != 0) body.conserves = false;
  if (!legal()) body.ordinary = false;
  return options;
}

// Whether its nodes are so far apart that a field of its rest shape holds more energy than any step can follow.
bool Sequence::is_torn_apart(const Body& body) {
  Eigen::Matrix3Xd nodes(3, body.soft->m_nodes.size());
  for (int i = 0; i < body.soft->m_nodes.size(); ++i) nodes.col(i) = to_vector(body.soft->m_nodes[i].m_x);
  return extent(nodes) > 10 * extent(body.mesh.vertices);
}

void Sequence::attach(Body& body, RandomField field, const AttachOptions& options) {
  AttachedBodies& solver = body.home->penalty();
  const bool was_attached = body.attached;
  const bool taken = attempt("attach", [&] { solver.attach(*body.soft, std::move(field.field), options); });
  body.attached = was_attached || taken;
  body.tangled = body.tangled || (taken && is_torn_apart(body));
  require(solver.is_attached(*body.soft) == body.attached,
          "a call that was refused has attached a body, or detached it");
}

void Sequence::make_body() {
  if (bodies_.size() > 4) return;
  const int odd_numbers = chance_.odd_numbers();
  auto body = std::make_unique<Body>();
  body->home = chance_.pick(worlds_).get();
  switch (chance_.index(4)) {
    case 0:
      body->mesh = make_box({1, 1, 1}, {1, 1, 1});
      break;
    case 1:
      body->mesh = make_ball(0.5, 1);
      break;
    default:
      body->mesh = make_box({1, 1, 1}, {1 + chance_.index(2), 1 + chance_.index(2), 2},
                            chance_.one_in(2) ? BoxSplit::five : BoxSplit::six);
  }
  body->mesh.vertices.colwise() += Vector3(chance_.uniform(-2, 2), chance_.uniform(0, 3), chance_.uniform(-2, 2));
  if (!legal() && chance_.one_in(8)) body->mesh.vertices.col(0)[chance_.index(3)] = chance_.anything();
  SoftBodyOptions options{.mass = chance_.number(0.1, 10),
                          .equal_masses = chance_.one_in(2),
                          .margin = chance_.number(0.001, 0.05),
                          .friction = chance_.number(0, 1)};
  if (chance_.one_in(5)) options.pinned.push_back(chance_.index(static_cast<int>(body->mesh.vertices.cols())));
  body->ordinary = chance_.odd_numbers() == odd_numbers;
  if (!attempt("make_soft_body", [&] {
        body->outside = make_soft_body(body->home->info(), body->mesh, options);
        body->soft = body->outside.get();
      }))
    return;
  attempt("making a field", [&] {
    const AttachOptions attach_options = random_options(*body);
    if (chance_.one_in(2)) attach(*body, field_for(*body), attach_options);
    body->home->add(std::move(body->outside));
    if (!body->attached) attach(*body, field_for(*body), attach_options);
  });
  // Bullet steps what is in its world by itself, which is not what is tested here.
  if (!body->attached && body->in_world()) body->outside = body->home->take_out(*body->soft);
  bodies_.push_back(std::move(body));
}

void Sequence::attach_again() {
  Body* body = pick_body();
  if (!body || chance_.one_in(2)) return;
  attempt("making a field", [&] {
    const AttachOptions options = random_options(*body);
    attach(*body, field_for(*body), options);
  });
}

void Sequence::attach_wrong_size() {
  Body* body = pick_body();
  if (!body) return;
  const bool was_attached = body->home->penalty().is_attached(*body->soft);
  bool refused = false;
  try {
    body->home->penalty().attach(*body->soft,
                                 PotentialField(Eigen::Matrix3Xd::Zero(3, body->soft->m_nodes.size() + 1)));
  } catch (const std::invalid_argument&) {
    refused = true;
  }
  require(refused, "a field of another size was attached");
  require(body->home->penalty().is_attached(*body->soft) == was_attached, "a refused field changed what is attached");
}

void Sequence::detach() {
  Body* body = pick_body();
  if (!body) return;
  forget_joints(*body);
  body->home->penalty().detach(*body->soft);
  body->attached = false;
  body->conserves = true;
  require(!body->home->penalty().is_attached(*body->soft), "a detached body is attached");
  if (body->in_world()) body->outside = body->home->take_out(*body->soft);
}

void Sequence::delete_body() {
  if (bodies_.empty()) return;
  const int number = chance_.index(static_cast<int>(bodies_.size()));
  Body& body = *bodies_[static_cast<std::size_t>(number)];
  const bool detaches = chance_.one_in(2);
  // A body may go without a word. In a misuse couplings are left that hold it.
  say(detaches ? "  detached before" : "  still attached");
  if (legal()) uncouple_all_of(body);
  if (detaches) {
    body.home->penalty().detach(*body.soft);
    forget_joints(body);
  }
  if (body.in_world()) body.outside = body.home->take_out(*body.soft);
  bodies_.erase(bodies_.begin() + number);
}

void Sequence::leave_or_enter_world() {
  Body* body = pick_attached();
  if (!body) return;
  if (!body->in_world()) {
    body->home->add(std::move(body->outside));
    return;
  }
  if (legal()) uncouple_all_of(*body);
  body->outside = body->home->take_out(*body->soft);
}

void Sequence::edit() {
  Body* body = pick_attached();
  if (!body) return;
  if (!legal()) body->ordinary = false;
  attempt("edit", [&] {
    PotentialField& field = body->home->penalty().edit(*body->soft);
    for (int k = 0; k < 3; ++k) change_elements(chance_, field);
  });
}

void Sequence::switch_fault() {
  if (legal()) return;
  fault_.throws = chance_.one_in(3);
  fault_.gives_nan = !fault_.throws && chance_.one_in(2);
  say(fault_.throws ? "  throws" : fault_.gives_nan ? "  is not a number" : "  none");
}

void Sequence::switch_callback() {
  Simulation& home = *chance_.pick(worlds_);
  call_back(home, std::find(called_back_.begin(), called_back_.end(), &home) == called_back_.end());
}

void Sequence::call_back(Simulation& home, bool on) {
  std::erase(called_back_, &home);
  for (const bool before : {false, true}) home.world().setInternalTickCallback(nullptr, this, before);
  if (!on) return;
  called_back_.push_back(&home);
  home.world().setInternalTickCallback(&Sequence::on_tick, this, chance_.one_in(2));
}

void Sequence::on_tick(btDynamicsWorld* world, btScalar) {
  Sequence& self = *static_cast<Sequence*>(world->getWorldUserInfo());
  if (self.depth_ > 1) return;
  try {
    if (self.chance_.one_in(2)) self.one_operation(true);
  } catch (const Finding& finding) {
    self.found_in_callback_ = finding.what();  // what is thrown here would leave the step
  }
}

void Sequence::step() {
  if (legal() && depth_ > 0) return;
  Simulation& home = *chance_.pick(worlds_);
  const int sort = chance_.index(5);
  for (int left = 1 + chance_.index(3); left > 0; --left)
    advance(home, sort == 0 ? chance_.uniform(0, 0.05) : 1.0 / 60, sort < 3 ? 0 : 3, sort == 3 ? 1.0 / 240 : 1.0 / 60);
}

void Sequence::step_oddly() {
  if (legal() && depth_ > 0) return;
  Simulation& home = *chance_.pick(worlds_);
  if (legal()) return advance(home, 0, 0, 1.0 / 60);
  // Bullet's own count of substeps is an int.
  const Real duration = std::clamp(chance_.anything(), -1e300, 1e300);
  advance(home, duration, std::abs(duration) < 1 ? chance_.index(3) : 0, 1.0 / 60);
}

void Sequence::append_node() {
  Body* body = pick_body();
  if (chance_.manner != Manner::misuse || !body || !chance_.one_in(3)) return;
  body->soft->appendNode(btVector3(0, 0, 0), 1);
  body->ordinary = false;
}

void Sequence::change_margin() {
  Body* body = pick_body();
  if (body) body->soft->getCollisionShape()->setMargin(static_cast<btScalar>(chance_.number(0.001, 0.1)));
}

void Sequence::change_gravity() {
  Simulation& home = *chance_.pick(worlds_);
  home.set_gravity({chance_.number(-1, 1), chance_.number(-20, 20), 0});
}

void Sequence::change_activation() {
  Body* body = pick_body();
  if (!body) return;
  constexpr int states[] = {ACTIVE_TAG, ISLAND_SLEEPING, WANTS_DEACTIVATION, DISABLE_DEACTIVATION, DISABLE_SIMULATION};
  body->soft->forceActivationState(chance_.pick(states));
  body->stopped = true;
}

}  // namespace penalty::testing
