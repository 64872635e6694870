#include "scenes/scene.h"

#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <stdexcept>

#include "penalty/bullet/soft_body.h"
#include "scenes/bullet_world.h"

namespace penalty::demo {
namespace {

btVector3 to_bullet(const Vector3& v) {
  return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}

Vector3 from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

Matrix3 from_bullet(const btMatrix3x3& m) {
  Matrix3 result;
  for (int row = 0; row < 3; ++row) result.row(row) = from_bullet(m[row]).transpose();
  return result;
}

btTransform to_bullet(const Pose& pose) {
  const Matrix3& r = pose.rotation;
  const auto row = [&r](int i) { return to_bullet(Vector3(r.row(i).transpose())); };
  const btVector3 x = row(0), y = row(1), z = row(2);
  return btTransform(btMatrix3x3(x.x(), x.y(), x.z(), y.x(), y.y(), y.z(), z.x(), z.y(), z.z()),
                     to_bullet(pose.position));
}

std::unique_ptr<btConvexInternalShape> make_shape(const RigidObject& object) {
  if (const auto* ball = std::get_if<Ball>(&object.shape))
    return std::make_unique<btSphereShape>(static_cast<btScalar>(ball->radius));
  return std::make_unique<btBoxShape>(to_bullet(std::get<Block>(object.shape).half_extents));
}

constexpr Real ground_half_width = 50, ground_half_height = 1;  // [m]

}  // namespace

std::string_view bullet_precision() { return sizeof(btScalar) == sizeof(float) ? "float32" : "float64"; }

struct Scene::Impl {
  SceneSetup setup;
  BulletWorld world;
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  std::vector<std::unique_ptr<btRigidBody>> rigid_bodies;  // the objects, then the ground
  std::vector<std::unique_ptr<btSoftBody>> bodies;
  std::vector<std::vector<WeightedPoint>> contact_points;  // of each body
  Real time = 0;
  std::size_t restarts_done = 0;
  Real time_asleep = 0;  // [s]
  int wakings = 0;

  Impl(SceneSetup given, WorldKind kind) : setup(std::move(given)), world(kind) {
    btSoftBodyWorldInfo& info = world.info();
    info.air_density = 0;
    info.water_density = 0;
    info.m_maxDisplacement = 1e6;
    info.m_sparsesdf.Initialize();
    info.m_sparsesdf.setDefaultVoxelsz(static_cast<btScalar>(voxel_size()));
    world.set_gravity(to_bullet(setup.gravity));

    for (const RigidObject& object : setup.objects) add_rigid(object);
    if (setup.ground) {
      add_rigid({.shape = Block{{ground_half_width, ground_half_height, ground_half_width}},
                 .pose = {.position = {0, -ground_half_height, 0}}});
      rigid_bodies.back()->setRestitution(1);
    }
    for (SoftObject& object : setup.bodies) add_soft(object);
  }

  ~Impl() {
    for (const auto& body : bodies) {
      world.attached().detach(*body);
      world.remove(*body);
    }
    for (const auto& rigid : rigid_bodies) world.world().removeRigidBody(rigid.get());
  }

  /// Bullet samples rigid shapes on a grid: a tenth of the smallest is fine enough for its corners.
  Real voxel_size() const {
    Real smallest = 2 * ground_half_height;
    for (const RigidObject& object : setup.objects) smallest = std::min(smallest, thickness(object));
    return smallest / 10;
  }

  void add_rigid(const RigidObject& object) {
    std::unique_ptr<btConvexInternalShape> shape = make_shape(object);
    const Real mass = object.pushes_back() ? object.mass : 0;
    btRigidBody::btRigidBodyConstructionInfo info(static_cast<btScalar>(mass), nullptr, shape.get(),
                                                  to_bullet(mass > 0 ? inertia(object) : Vector3::Zero()));
    info.m_startWorldTransform = to_bullet(object.path ? object.path(0) : object.pose);
    info.m_friction = object.friction;
    info.m_rollingFriction = 0.05f;
    auto body_of_shape = std::make_unique<btRigidBody>(info);
    if (object.path) {
      body_of_shape->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
      body_of_shape->setActivationState(DISABLE_DEACTIVATION);
    }
    world.world().addRigidBody(body_of_shape.get());
    rigid_bodies.push_back(std::move(body_of_shape));
    shapes.push_back(std::move(shape));
  }

  void add_soft(SoftObject& object) {
    constexpr Real margin = 0.02;  // that scenes reckon with [m]
    const SoftBodyOptions options{
        .mass = object.mass, .pinned = object.pinned, .margin = margin, .friction = object.friction};
    auto started = object.mesh.mesh;
    std::unique_ptr<btSoftBody> body = std::visit(
        [&](auto& mesh) {
          mesh.vertices = object.positions;
          return make_soft_body(world.info(), mesh, options);
        },
        started);
    for (int i = 0; i < object.velocities.cols(); ++i) body->m_nodes[i].m_v = to_bullet(object.velocities.col(i));
    // What is measured does not fall asleep, unless sleep is what the scene shows.
    body->forceActivationState(setup.sleeps ? ACTIVE_TAG : DISABLE_DEACTIVATION);
    body->setRestitution(static_cast<btScalar>(object.restitution));
    world.add(*body);
    AttachOptions attach{.step = setup.step, .contact_points = object.mesh.contact_points()};
    if (object.mesh.surface) attach.surface = BodySurface::of(*object.mesh.surface);
    std::vector<WeightedPoint>& points = contact_points.emplace_back(attach.contact_points);
    if (points.empty())
      for (int i = 0; i < body->m_nodes.size(); ++i) points.push_back(WeightedPoint::at_particle(i));
    world.attached().attach(*body, std::move(object.field), attach);
    bodies.push_back(std::move(body));
  }

  void restart_if_due(Real step) {
    while (restarts_done < setup.restarts.size() && time >= setup.restarts[restarts_done].time - step / 4) {
      const Restart& restart = setup.restarts[restarts_done++];
      btSoftBody& body = *bodies[restart.body];
      for (int i = 0; i < body.m_nodes.size(); ++i) {
        body.m_nodes[i].m_x = to_bullet(restart.positions.col(i));
        body.m_nodes[i].m_v.setZero();
      }
    }
  }

  // To where they will be at the present time, when the step ends.
  void carry_pinned() {
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      const SoftObject& object = setup.bodies[b];
      if (object.carrier < 0) continue;
      const auto& path = setup.objects[static_cast<std::size_t>(object.carrier)].path;
      const Pose from = path(0), to = path(time);
      for (const int i : object.pinned)
        bodies[b]->m_nodes[i].m_x = to_bullet(Vector3(to.position + to.rotation * from.local(object.positions.col(i))));
    }
  }

  const AttachedBodies& attached() const { return const_cast<BulletWorld&>(world).attached(); }
  const Particles& particles(std::size_t body) const { return attached().particles(*bodies[body]); }
};

Scene::Scene(SceneSetup setup, WorldKind world) : impl_(std::make_unique<Impl>(std::move(setup), world)) {}
Scene::~Scene() = default;

void Scene::step(Real duration) {
  Impl& scene = *impl_;
  const bool was_asleep = is_asleep();
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const SoftObject& object = scene.setup.bodies[b];
    if (object.control && scene.time >= object.control_start - duration / 4)
      object.control(scene.world.attached().edit(*scene.bodies[b]), scene.time);
  }
  scene.restart_if_due(duration);
  scene.time += duration;
  scene.carry_pinned();
  for (std::size_t b = 0; b < scene.setup.objects.size(); ++b)
    if (const auto& path = scene.setup.objects[b].path)
      scene.rigid_bodies[b]->setWorldTransform(to_bullet(path(scene.time)));  // Bullet makes a velocity of the way
  scene.world.step(duration);
  if (is_asleep()) scene.time_asleep += duration;
  if (was_asleep && !is_asleep()) ++scene.wakings;
  if (scene.setup.watch) scene.setup.watch(state());
}

Real Scene::time() const { return impl_->time; }

const SceneSetup& Scene::setup() const { return impl_->setup; }
const PotentialField& Scene::field(std::size_t body) const { return impl_->attached().field(*impl_->bodies[body]); }
const Particles& Scene::particles(std::size_t body) const { return impl_->particles(body); }
const StepReport& Scene::report(std::size_t body) const { return impl_->attached().report(*impl_->bodies[body]); }

SceneState Scene::state() const {
  SceneState state{.time = time(), .objects = objects()};
  for (std::size_t b = 0; b < impl_->bodies.size(); ++b) state.bodies.push_back({particles(b), field(b)});
  return state;
}

StepReport Scene::report() const {
  StepReport all;
  for (std::size_t b = 0; b < impl_->bodies.size(); ++b) {
    const StepReport& one = report(b);
    if (one.integrator == Integrator::implicit_step) all.integrator = one.integrator;
    all.substeps = std::max(all.substeps, one.substeps);
    all.newton_iterations += one.newton_iterations;
    all.retries = std::max(all.retries, one.retries);
    all.finite = all.finite && one.finite;
    all.contact_depth = std::max(all.contact_depth, one.contact_depth);
    all.num_contacts += one.num_contacts;
  }
  return all;
}

std::vector<LedgerEntry> Scene::ledger() const {
  std::vector<LedgerEntry> all;
  for (const auto& body : impl_->bodies)
    for (LedgerEntry& entry : impl_->attached().ledger(*body)) all.push_back(std::move(entry));
  return all;
}

EnergyFlows Scene::flows() const {
  EnergyFlows all;
  for (const auto& body : impl_->bodies) all += impl_->attached().flows(*body);
  return all;
}

bool Scene::is_asleep() const {
  return std::all_of(impl_->bodies.begin(), impl_->bodies.end(),
                     [](const auto& body) { return body->getActivationState() == ISLAND_SLEEPING; });
}

Energies Scene::energies() const {
  Energies energies;
  const Vector3& gravity = impl_->setup.gravity;
  for (const auto& [p, field] : state().bodies) {
    energies.elastic += field.energy(p.positions);
    energies.kinetic += kinetic_energy(p);
    for (int i = 0; i < p.size(); ++i)
      if (p.inverse_masses[i] > 0)
        energies.gravitational -= gravity.dot(p.positions.col(i).head<3>()) / p.inverse_masses[i];
  }
  for (std::size_t b = 0; b < impl_->setup.objects.size(); ++b) {
    const RigidObject& object = impl_->setup.objects[b];
    if (!object.pushes_back()) continue;
    const btRigidBody& rigid = *impl_->rigid_bodies[b];
    const Vector3 spin =
        from_bullet(rigid.getCenterOfMassTransform().getBasis()).transpose() * from_bullet(rigid.getAngularVelocity());
    energies.rigid_kinetic += object.mass / 2 * from_bullet(rigid.getLinearVelocity()).squaredNorm() +
                              spin.dot(inertia(object).cwiseProduct(spin)) / 2;
    energies.gravitational -= object.mass * gravity.dot(from_bullet(rigid.getCenterOfMassPosition()));
  }
  return energies;
}

Momenta Scene::momenta() const {
  Momenta momenta;
  for (const auto& [p, field] : state().bodies) {
    momenta.linear += linear_momentum(p);
    momenta.angular += angular_momentum(p);
    for (int i = 0; i < p.size(); ++i) {
      if (!(p.inverse_masses[i] > 0)) continue;
      const Real momentum = p.velocities.col(i).norm() / p.inverse_masses[i];
      momenta.linear_scale += momentum;
      momenta.angular_scale += momentum * p.positions.col(i).norm();
    }
  }
  return momenta;
}

std::vector<Pose> Scene::objects() const {
  std::vector<Pose> poses;
  for (std::size_t b = 0; b < impl_->setup.objects.size(); ++b) {
    const btTransform& transform = impl_->rigid_bodies[b]->getWorldTransform();
    poses.push_back({from_bullet(transform.getBasis()), from_bullet(transform.getOrigin())});
  }
  return poses;
}

Real Scene::penetration() const {
  const std::vector<Pose> poses = objects();
  Real deepest = 0;
  for (std::size_t body = 0; body < impl_->bodies.size(); ++body) {
    const PackedVectors& positions = particles(body).positions;
    for (const WeightedPoint& point : impl_->contact_points[body]) {
      const Vector3 position = point.of(positions);
      if (impl_->setup.ground) deepest = std::max(deepest, -position.y());
      for (std::size_t b = 0; b < poses.size(); ++b)
        deepest = std::max(deepest, depth(impl_->setup.objects[b], poses[b], position));
    }
  }
  return deepest;
}

std::optional<Real> Scene::tip_drop() const {
  Real start = 0, now = 0, vertices = 0;
  for (std::size_t b = 0; b < impl_->bodies.size(); ++b)
    for (const int i : impl_->setup.bodies[b].tip) {
      start += impl_->setup.bodies[b].positions(1, i);
      now += particles(b).positions(1, i);
      ++vertices;
    }
  if (vertices == 0) return {};
  return start / vertices - now / vertices;
}

std::vector<Fact> Scene::facts() const {
  const Impl& scene = *impl_;
  std::vector<Fact> facts = scene.setup.facts ? scene.setup.facts(state()) : std::vector<Fact>{};
  if (scene.setup.sleeps) {
    facts.push_back({"time_asleep", scene.time_asleep});
    facts.push_back({"wakings", static_cast<double>(scene.wakings)});
  }
  return facts;
}

bool Scene::is_free() const {
  const SceneSetup& setup = impl_->setup;
  return setup.gravity.isZero(0) && !setup.ground && setup.objects.empty() && setup.step.drag == 0 &&
         setup.restarts.empty() && std::all_of(setup.bodies.begin(), setup.bodies.end(), [](const SoftObject& object) {
           return object.pinned.empty();
         });
}

}  // namespace penalty::demo
