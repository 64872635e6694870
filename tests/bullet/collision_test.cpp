// Momentum and energy of free bodies, alone and in collision with rigid ones. Limits in single precision are the
// rounding of Bullet's own rigid velocities and transforms; the soft bodies are carried in double.
#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

class Collision : public WorldTest {
 protected:
  // Steps, watching. Drifts are relative to `momentum_scale`, which is what flies about.
  void watch(int steps, Real momentum_scale, Real angular_scale) {
    const Totals start = sim.totals();
    Totals last = start;
    highest_energy = start.energy;
    for (int k = 0; k < steps; ++k) {
      sim.step(frame);
      const Totals now = sim.totals();
      momentum_drift = std::max(momentum_drift, (now.momentum - start.momentum).norm() / momentum_scale);
      angular_drift = std::max(angular_drift, (now.angular_momentum - start.angular_momentum).norm() / angular_scale);
      largest_gain = std::max(largest_gain, now.energy - last.energy);
      highest_energy = std::max(highest_energy, now.energy);
      last = now;
    }
    end_energy = last.energy;
    RecordProperty("momentum_drift", std::to_string(momentum_drift * 1e12) + "e-12");
    RecordProperty("angular_drift", std::to_string(angular_drift * 1e12) + "e-12");
    RecordProperty("energy", std::to_string(start.energy) + " -> " + std::to_string(end_energy) + " J, highest +" +
                                 std::to_string(highest_energy - start.energy));
  }

  void expect_momentum_kept() const {
    EXPECT_LT(momentum_drift, limit(1e-10, 1e-4));
    EXPECT_LT(angular_drift, limit(1e-10, 1e-4));
  }

  Real momentum_drift = 0, angular_drift = 0, largest_gain = 0, highest_energy = 0, end_energy = 0;
};

TEST_P(Collision, AFreeSpinningStretchedBodyKeepsItsMomentaForTenSeconds) {
  const TetMesh box = make_box({2, 0.5, 0.5}, {8, 2, 2});
  btSoftBody& body = sim.add_jelly(box);
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    btSoftBody::Node& node = body.m_nodes[i];
    const Vector3 x = to_vector(node.m_x);
    node.m_v = to_bullet(Vector3(Vector3(0.5, 0, 0) + Vector3(0.3, 1, 3).cross(x)));
    node.m_x *= static_cast<btScalar>(1.1);
  }
  sim.penalty().synchronize(body);
  const Totals start = sim.totals();
  ASSERT_GT(start.momentum.norm(), 0.1);
  ASSERT_GT(start.angular_momentum.norm(), 0.1);
  watch(600, start.momentum.norm(), start.angular_momentum.norm());
  expect_momentum_kept();
  EXPECT_LT(momentum_drift, 1e-10) << "carried in double whatever Bullet's precision";
  EXPECT_LT(highest_energy, 1.005 * start.energy);
}

// Tori of 1 kg at rest, hit by a rigid body at 5 m/s, off centre. A hit is inelastic for the layer of nodes that it
// meets, so energy falls; what a step may gain in between is up to the energy guard's tolerance (0.5 %). Spheres and
// cubes turn without gyroscopic torque.
class RigidHit : public Collision {
 protected:
  void hit(std::unique_ptr<btCollisionShape> shape, Real mass, const Matrix3& rotation) {
    const TetMesh torus = make_torus(0.7, 0.3, 2, 18);
    sim.add_jelly(torus);
    btRigidBody& rigid = sim.add_rigid(std::move(shape), mass, {1.6, 0.05, 0.03}, rotation);
    rigid.setLinearVelocity(btVector3(-5, 0, 0));
    const Real start = sim.totals().energy;
    watch(60, 5 * mass, 5 * mass * 1.6);  // angular: as if it passed at its own distance
    expect_momentum_kept();
    EXPECT_GT(Real(rigid.getLinearVelocity().x()), -4.9) << "did not hit";
    EXPECT_LT(highest_energy, 1.005 * start);
    EXPECT_LT(end_energy, start);
    EXPECT_GT(end_energy, 0.6 * start);
    EXPECT_LT(largest_gain, 0.005 * start);
  }
};

TEST_P(RigidHit, LightBox) { hit(std::make_unique<btBoxShape>(btVector3(0.25, 0.25, 0.25)), 0.1, Matrix3::Identity()); }
TEST_P(RigidHit, EquallyHeavyBox) {
  hit(std::make_unique<btBoxShape>(btVector3(0.25, 0.25, 0.25)), 1, Matrix3::Identity());
}
TEST_P(RigidHit, HeavyBox) { hit(std::make_unique<btBoxShape>(btVector3(0.25, 0.25, 0.25)), 10, Matrix3::Identity()); }
TEST_P(RigidHit, LightSphere) { hit(std::make_unique<btSphereShape>(0.25), 0.1, Matrix3::Identity()); }
TEST_P(RigidHit, EquallyHeavySphere) { hit(std::make_unique<btSphereShape>(0.25), 1, Matrix3::Identity()); }
TEST_P(RigidHit, HeavySphere) { hit(std::make_unique<btSphereShape>(0.25), 10, Matrix3::Identity()); }
TEST_P(RigidHit, BoxEdgeFirst) {
  Random random(4);
  hit(std::make_unique<btBoxShape>(btVector3(0.25, 0.25, 0.25)), 1, random.rotation());
}

TEST_P(Collision, TwoSoftBodiesHittingOneRigidBodyKeepTheMomentum) {
  const TetMesh ball = make_ball(0.4, 3);
  btSoftBody& left = sim.add_jelly(ball, {.shift = {-1, 0.03, 0}});
  btSoftBody& right = sim.add_jelly(ball, {.shift = {1, -0.02, 0.05}});
  btRigidBody& box = sim.add_box({0.35, 0.35, 0.35}, 0.5, {0, 0, 0});
  for (int i = 0; i < left.m_nodes.size(); ++i) {
    left.m_nodes[i].m_v = btVector3(4, 0, 0);
    right.m_nodes[i].m_v = btVector3(-4, 1, 0);
  }
  sim.penalty().synchronize(left);
  sim.penalty().synchronize(right);
  const Real start = sim.totals().energy;
  watch(60, 4 + 4, 8);
  expect_momentum_kept();
  EXPECT_LT(highest_energy, 1.005 * start);
  EXPECT_LT(linear_momentum(sim.penalty().particles(left)).x(), 0) << "bounced";
  EXPECT_GT(linear_momentum(sim.penalty().particles(right)).x(), 0) << "bounced";
  EXPECT_TRUE(std::isfinite(Real(box.getLinearVelocity().length())));
}

// A chain: each pair of neighbours touches the same rigid body, so all of them are one island.
TEST_P(Collision, AChainOfSoftAndRigidBodiesKeepsTheMomentum) {
  const TetMesh ball = make_ball(0.3, 2);
  std::vector<btSoftBody*> balls;
  balls.reserve(3);
  for (int k = 0; k < 3; ++k) balls.push_back(&sim.add_jelly(ball, {.shift = {1.2 * k, 0, 0}}));
  for (int k = 0; k < 2; ++k) sim.add_box({0.25, 0.25, 0.25}, 0.5, {1.2 * k + 0.6, 0, 0});
  for (int i = 0; i < balls[0]->m_nodes.size(); ++i) balls[0]->m_nodes[i].m_v = btVector3(3, 0, 0);
  sim.penalty().synchronize(*balls[0]);
  const Real start = sim.totals().energy;
  watch(60, 3, 3);
  expect_momentum_kept();
  EXPECT_LT(highest_energy, 1.005 * start);
  EXPECT_GT(linear_momentum(sim.penalty().particles(*balls[2])).x(), 0.5) << "the push went through";
}

// A thin plate far too fast to be seen inside the soft body at the end of any step. It is set spinning, and Bullet
// integrates gyroscopic torque to first order only: angular momentum drifts by about one per cent of the spin.
TEST_P(Collision, AFastPlateDoesNotTunnel) {
  const TetMesh ball = make_ball(0.5, 3);
  btSoftBody& body = sim.add_jelly(ball);
  btRigidBody& plate = sim.add_box({0.1, 0.4, 0.4}, 0.5, {3, 0.01, 0.02});
  plate.setLinearVelocity(btVector3(-50, 0, 0));
  const Real start = sim.totals().energy;
  watch(30, 25, 25);
  EXPECT_LT(momentum_drift, limit(1e-10, 1e-4));
  EXPECT_LT(angular_drift, 3e-4);
  EXPECT_LT(highest_energy, 1.005 * start);
  const Real soft_x = center_of_mass(sim.penalty().particles(body)).x();
  EXPECT_GT(Real(plate.getWorldTransform().getOrigin().x()), soft_x) << "still on the side it came from";
}

TEST_P(Collision, AFastCubeDoesNotTunnel) {
  btSoftBody& body = sim.add_jelly(make_ball(0.5, 3));
  btRigidBody& cube = sim.add_box({0.2, 0.2, 0.2}, 0.5, {3, 0.01, 0.02});
  cube.setLinearVelocity(btVector3(-50, 0, 0));
  const Real start = sim.totals().energy;
  watch(30, 25, 25);
  expect_momentum_kept();
  EXPECT_LT(highest_energy, 1.005 * start);
  const Real soft_x = center_of_mass(sim.penalty().particles(body)).x();
  EXPECT_GT(Real(cube.getWorldTransform().getOrigin().x()), soft_x) << "still on the side it came from";
}

INSTANTIATE_TEST_SUITE_P(World, Collision, both_worlds(), param_name);
INSTANTIATE_TEST_SUITE_P(World, RigidHit, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
