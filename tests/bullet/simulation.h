// Both of Bullet's soft-body worlds behind one face, and what is measured in them.
#pragma once
#include "math/random.h"  // before Bullet, one of whose headers has a global called seed

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletSoftBody/btSoftBody.h>
#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <ostream>
#include <vector>

#include "convert.h"
#include "penalty/bullet/attached_bodies.h"
#include "penalty/bullet/soft_body.h"
#include "penalty/fields/batch_loops.h"
#include "penalty/fields/elastic_field.h"
#include "penalty/mesh/builders.h"
#include "scenes/bullet_world.h"

namespace penalty::demo {

void PrintTo(WorldKind kind, std::ostream* out);  // NOLINT(readability-identifier-naming): googletest's name

}  // namespace penalty::demo

namespace penalty::testing {

using demo::WorldKind;
using Solver = demo::SoftSolver;

inline constexpr bool double_bullet = sizeof(btScalar) == sizeof(double);
inline constexpr btScalar nan = std::numeric_limits<btScalar>::quiet_NaN();
inline constexpr btScalar inf = std::numeric_limits<btScalar>::infinity();
inline constexpr Real frame = 1.0 / 60;        // [s]
inline constexpr Real exact_frame = 1.0 / 64;  // sums of it are exact [s]
inline constexpr Real g = 9.81;                // [m/s²]

/// The limit that holds in this build of Bullet.
inline Real limit(Real in_double, Real in_float) { return double_bullet ? in_double : in_float; }

Matrix3 turned(Real angle, const Vector3& axis);

/// Of a point from a box about the origin, negative within.
Real box_distance(const Vector3& point, const Vector3& half_extents);

std::string world_name(WorldKind kind);  // "classic_float64"

/// A soft body made of a mesh, at rest where it starts.
struct JellyOptions {
  Real stiffness = 10;  // of every edge and tetrahedron [J]
  Vector3 shift = Vector3::Zero();
  /// Margins are 2 cm, whatever its size; the friction of a pair is that of the rigid body.
  SoftBodyOptions body = {.margin = 0.02, .friction = 1};
  AttachOptions attach = {};
};

/// Momenta and energy of attached soft bodies and movable rigid ones.
struct Totals {
  Vector3 momentum = Vector3::Zero();          // [kg m/s]
  Vector3 angular_momentum = Vector3::Zero();  // about the origin [kg m²/s]
  Real energy = 0;                             // kinetic + elastic + in gravity [J]
};

/// A world and all that is in it, taken apart in the right order. Bodies do not fall asleep unless a test lets them.
class Simulation {
 public:
  explicit Simulation(WorldKind kind, Solver solver = Solver::penalty);
  ~Simulation();

  btDiscreteDynamicsWorld& world() { return world_.world(); }
  btDeformableMultiBodyDynamicsWorld& deformable_world() { return world_.deformable(); }
  btSoftBodyWorldInfo& info() { return world_.info(); }
  AttachedBodies& penalty() { return world_.attached(); }
  void set_gravity(const Vector3& gravity) { world_.set_gravity(to_bullet(gravity)); }

  btSoftBody& add(std::unique_ptr<btSoftBody> body);
  btSoftBody& add_jelly(const TetMesh& mesh, const JellyOptions& options = {});
  btRigidBody& add_rigid(std::unique_ptr<btCollisionShape> shape, Real mass, const Vector3& position,
                         const Matrix3& rotation = Matrix3::Identity());
  btRigidBody& add_box(const Vector3& half_extents, Real mass, const Vector3& position,
                       const Matrix3& rotation = Matrix3::Identity());
  btRigidBody& add_ground(Real friction = 0.5);  // a large box below y = 0

  std::unique_ptr<btSoftBody> take_out(btSoftBody& body);  // no longer in the world, still attached
  void remove(btSoftBody& body);                           // detached, out of the world and deleted
  void remove(btRigidBody& body);

  /// World steps without Bullet's own substeps.
  void step(Real duration, int count = 1);

  Totals totals();

 private:
  demo::BulletWorld world_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btSoftBody>> soft_bodies_;
  std::vector<std::unique_ptr<btRigidBody>> rigid_bodies_;
};

/// A test that runs in both worlds.
class WorldTest : public ::testing::TestWithParam<WorldKind> {
 protected:
  Simulation sim{GetParam()};
};

inline auto both_worlds() { return ::testing::Values(WorldKind::classic, WorldKind::deformable); }
inline auto classic_world() { return ::testing::Values(WorldKind::classic); }
inline auto deformable_world() { return ::testing::Values(WorldKind::deformable); }
inline std::string param_name(const ::testing::TestParamInfo<WorldKind>& info) { return world_name(info.param); }

void let_sleep(btCollisionObject& object);
Vector3 center_of_mass(const Particles& particles);
std::vector<Vector3> places_of(const btSoftBody& body);                         // of the nodes [m]
Real lowest(const btSoftBody& body);                                            // y of the lowest node [m]
Real mean_volume_error(const AttachedBodies& penalty, const btSoftBody& body);  // mean |V/V0 - 1|
TetMesh moved(TetMesh mesh, const Vector3& shift);

}  // namespace penalty::testing
