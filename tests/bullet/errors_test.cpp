// What is refused, and what happens to numbers that are not finite.
#include <limits>

#include "bullet/simulation.h"
#include "penalty/bullet/deformable_penalty_force.h"

namespace penalty::testing {
namespace {

constexpr btScalar infinite = std::numeric_limits<btScalar>::infinity();

template <class Call>
std::string refusal(const Call& call) {
  return complaint<std::invalid_argument>(call);
}

class NotFinite : public WorldTest {
 protected:
  void SetUp() override {
    sim.set_gravity({0, -9.81, 0});
    sim.add_ground();
    body = &sim.add_jelly(make_ball(0.25, 2), {.shift = {0, 0.5, 0}});
    sim.step(frame, 5);
  }

  bool nodes_are_finite() const {
    for (int i = 0; i < body->m_nodes.size(); ++i)
      if (!std::isfinite(body->m_nodes[i].m_x.length2() + body->m_nodes[i].m_v.length2())) return false;
    return true;
  }

  // The step after a fault names the node and sets it back; then all goes on as if nothing had been.
  void expect_recovery(int node) {
    sim.step(frame);
    EXPECT_FALSE(sim.penalty().report(*body).finite);
    EXPECT_EQ(sim.penalty().report(*body).first_bad_particle, node);
    EXPECT_TRUE(nodes_are_finite());
    sim.step(frame);
    EXPECT_TRUE(sim.penalty().report(*body).finite);
    EXPECT_EQ(sim.penalty().report(*body).first_bad_particle, -1);
    sim.step(frame, 60);
    EXPECT_TRUE(nodes_are_finite());
    EXPECT_GT(lowest(*body), 0);
    EXPECT_LT(mean_volume_error(sim.penalty(), *body), 0.1);
  }

  btSoftBody* body = nullptr;
};

TEST_P(NotFinite, APositionIsSetBack) {
  body->m_nodes[17].m_x.setY(nan);
  expect_recovery(17);
}

TEST_P(NotFinite, AVelocityIsSetBack) {
  body->m_nodes[3].m_v.setX(nan);
  expect_recovery(3);
}

TEST_P(NotFinite, InfinityIsSetBack) {
  body->m_nodes[5].m_v.setZ(infinite);
  expect_recovery(5);
}

TEST_P(NotFinite, OtherNodesGoOnMeanwhile) {
  Simulation other(GetParam());
  other.set_gravity({0, -9.81, 0});
  other.add_ground();
  btSoftBody& reference = other.add_jelly(make_ball(0.25, 2), {.shift = {0, 0.5, 0}});
  other.step(frame, 5);
  body->m_nodes[3].m_v.setX(nan);
  sim.step(frame, 5);
  other.step(frame, 5);
  EXPECT_EQ(sim.penalty().particles(*body).positions, other.penalty().particles(reference).positions);
}

TEST_P(NotFinite, AnInverseMassIsSetBack) {
  for (const btScalar bad : {nan, infinite, btScalar(-1)}) {
    body->m_nodes[7].m_im = bad;
    expect_recovery(7);
    EXPECT_GT(body->m_nodes[7].m_im, 0);
  }
}

TEST_P(NotFinite, AMassOfTheWholeIsSetBackAndMended) {
  body->setTotalMass(nan);
  expect_recovery(0);
  body->setTotalMass(2);
  sim.step(frame, 10);
  Real mass = 0;
  for (const Real inverse : sim.penalty().particles(*body).inverse_masses) mass += 1 / inverse;
  EXPECT_NEAR(mass, 2, 1e-5);
}

// Bullet makes the masses of nodes inside zero, and their inverses infinite.
TEST_P(NotFinite, AMassOnTheFacesAloneIsSetBackInside) {
  body->setTotalMass(1, true);
  sim.step(frame);
  EXPECT_FALSE(sim.penalty().report(*body).finite);
  sim.step(frame, 60);
  EXPECT_TRUE(sim.penalty().report(*body).finite);
  EXPECT_TRUE(nodes_are_finite());
  EXPECT_GT(lowest(*body), 0);
}

TEST_P(NotFinite, TheProblemIsNamed) {
  const auto problem_of = [&](btScalar& number) {
    number = nan;
    sim.step(frame);
    return sim.penalty().report(*body).problem;
  };
  const std::string end = " is not finite, and was set back";
  EXPECT_EQ(problem_of(body->m_nodes[17].m_x[1]), "node 17: its position" + end);
  EXPECT_EQ(problem_of(body->m_nodes[3].m_v[0]), "node 3: its velocity" + end);
  EXPECT_EQ(problem_of(body->m_nodes[4].m_f[0]), "node 4: its force" + end);
  EXPECT_EQ(problem_of(body->m_nodes[4].m_im), "node 4: its inverse mass is negative or not finite, and was set back");
  sim.step(frame);
  EXPECT_EQ(sim.penalty().report(*body).problem, "");
}

TEST_P(NotFinite, SynchronizeSetsBackToo) {
  body->m_nodes[17].m_x.setY(nan);
  sim.penalty().synchronize(*body);
  EXPECT_TRUE(nodes_are_finite());
  EXPECT_TRUE(sim.penalty().particles(*body).positions.allFinite());
}

TEST_P(NotFinite, AForceIsDropped) {
  body->addForce(btVector3(nan, 0, 0), 4);
  body->addForce(btVector3(0, 1, 0), 5);
  expect_recovery(4);
}

INSTANTIATE_TEST_SUITE_P(World, NotFinite, both_worlds(), param_name);

class Refused : public WorldTest {
 protected:
  btSoftBody& add_ball() { return sim.add(make_soft_body(sim.info(), ball)); }
  PotentialField field() const { return make_elastic_field(ball.vertices, ball.tetrahedra, 1.0); }
  std::string attaching_with(const AttachOptions& options) {
    btSoftBody& body = add_ball();
    const std::string what = refusal([&] { sim.penalty().attach(body, field(), options); });
    EXPECT_FALSE(sim.penalty().is_attached(body));
    sim.step(frame);
    return what;
  }
  std::string stepping_with(const StepOptions& step) { return attaching_with({.step = step}); }
  std::string touching_with(const WeightedPoint& point) {
    AttachOptions options;
    options.contact_points = {WeightedPoint::at_particle(0), point};
    return attaching_with(options);
  }
  std::string making_with(const SoftBodyOptions& options) {
    return refusal([&] { make_soft_body(sim.info(), ball, options); });
  }

  const TetMesh ball = make_ball(0.25, 1);  // 13 vertices
};

TEST_P(Refused, ASurfaceThatIsNotOfTheBody) {
  AttachOptions options;
  options.surface.points = {WeightedPoint::at_particle(0), WeightedPoint::at_particle(13)};
  EXPECT_EQ(attaching_with(options), "attach: surface point 1: index 13 is outside the 13 nodes");
  options.surface.points[1] = {{0, 1}, {1.5, -0.5}, 2};
  EXPECT_EQ(attaching_with(options),
            "attach: surface point 1: weight -0.5 is negative: it lies outside the particles that carry it");
  options.surface.points[1] = WeightedPoint::at_particle(1);
  options.surface.triangles = {{0, 1, 2}};
  EXPECT_EQ(attaching_with(options), "attach: surface triangle 0: index 2 is outside the 2 surface points");
}

TEST_P(Refused, AFieldForAnotherNumberOfParticles) {
  btSoftBody& body = add_ball();
  EXPECT_EQ(refusal([&] { sim.penalty().attach(body, PotentialField(Eigen::Matrix3Xd::Zero(3, 5))); }),
            "attach: the field has 5 particles, the soft body 13 nodes");
  EXPECT_FALSE(sim.penalty().is_attached(body));
}

TEST_P(Refused, NodesThatAreNoNumbers) {
  const auto attaching = [&](const auto& spoil) {
    btSoftBody& body = add_ball();
    spoil(body.m_nodes[3]);
    std::string what = refusal([&] { sim.penalty().attach(body, field()); });
    EXPECT_FALSE(sim.penalty().is_attached(body));
    sim.remove(body);
    return what;
  };
  using Node = btSoftBody::Node;
  EXPECT_EQ(attaching([](Node& node) { node.m_x.setY(nan); }), "attach: node 3: position y is nan, must be finite");
  EXPECT_EQ(attaching([](Node& node) { node.m_x.setX(-infinite); }),
            "attach: node 3: position x is -inf, must be finite");
  EXPECT_EQ(attaching([](Node& node) { node.m_v.setZ(nan); }), "attach: node 3: velocity z is nan, must be finite");
  const std::string range = ", must be zero (pinned) or positive and finite";
  EXPECT_EQ(attaching([](Node& node) { node.m_im = nan; }), "attach: node 3: inverse mass is nan" + range);
  EXPECT_EQ(attaching([](Node& node) { node.m_im = infinite; }), "attach: node 3: inverse mass is inf" + range);
  EXPECT_EQ(attaching([](Node& node) { node.m_im = -2; }), "attach: node 3: inverse mass is -2" + range);
}

TEST_P(Refused, AWorldInfoWithoutBroadphase) {
  btSoftBodyWorldInfo info;
  const auto body = make_soft_body(info, ball);
  EXPECT_EQ(refusal([&] { sim.penalty().attach(*body, field()); }),
            "attach: the soft body's world info has no broadphase: use that of the world");
}

TEST_P(Refused, QuestionsAboutABodyThatIsNotAttached) {
  const btSoftBody& body = add_ball();
  EXPECT_EQ(refusal([&] { sim.penalty().particles(body); }), "soft body is not attached");
  EXPECT_EQ(refusal([&] { sim.penalty().field(body); }), "soft body is not attached");
  EXPECT_EQ(refusal([&] { sim.penalty().report(body); }), "soft body is not attached");
  EXPECT_EQ(refusal([&] { sim.penalty().refresh(body); }), "soft body is not attached");
  EXPECT_EQ(refusal([&] { sim.penalty().synchronize(body); }), "soft body is not attached");
}

TEST_P(Refused, ContactPointsThatAreNotPointsOfTheBody) {
  EXPECT_EQ(touching_with({}), "attach: contact point 1: has 0 particles, must have 1 to 4");
  EXPECT_EQ(touching_with({{0}, {1}, 5}), "attach: contact point 1: has 5 particles, must have 1 to 4");
  EXPECT_EQ(touching_with(WeightedPoint::at_particle(13)), "attach: contact point 1: index 13 is outside the 13 nodes");
  EXPECT_EQ(touching_with(WeightedPoint::at_particle(-1)), "attach: contact point 1: index -1 is outside the 13 nodes");
  EXPECT_EQ(touching_with({{0, 1}, {0.5, 0.25}, 2}), "attach: contact point 1: weights sum to 0.75, must sum to 1");
  EXPECT_EQ(touching_with({{0, 1}, {0.5, Real(nan)}, 2}), "attach: contact point 1: weights sum to nan, must sum to 1");
}

TEST_P(Refused, StepOptionsOutOfRange) {
  EXPECT_EQ(stepping_with({.damping_time = -1}), "step: damping_time is -1, must be zero or positive [s]");
  EXPECT_EQ(stepping_with({.damping_time = Real(infinite)}), "step: damping_time is inf, must be zero or positive [s]");
  EXPECT_EQ(stepping_with({.drag = -0.5}), "step: drag is -0.5, must be zero or positive [1/s]");
  EXPECT_EQ(stepping_with({.substeps = -3}), "step: substeps is -3, must be zero (automatic) or positive");
  EXPECT_EQ(stepping_with({.safety = 0}), "step: safety is 0, must be in (0, 1]");
  EXPECT_EQ(stepping_with({.safety = Real(nan)}), "step: safety is nan, must be in (0, 1]");
  EXPECT_EQ(stepping_with({.contact_safety = 1.5}), "step: contact_safety is 1.5, must be in (0, 1]");
  EXPECT_EQ(stepping_with({.energy_tolerance = 0}), "step: energy_tolerance is 0, must be positive");
  EXPECT_EQ(stepping_with({.max_substeps = 0}), "step: max_substeps is 0, must be at least 1");
  EXPECT_EQ(stepping_with({.contact_slop = -1}), "step: contact_slop is -1, must be zero or positive [m]");
}

TEST_P(Refused, SoftBodyOptionsOutOfRange) {
  EXPECT_EQ(making_with({.mass = 0}), "soft body: mass is 0, must be positive and finite [kg]");
  EXPECT_EQ(making_with({.mass = Real(nan)}), "soft body: mass is nan, must be positive and finite [kg]");
  EXPECT_EQ(making_with({.margin = -1}), "soft body: margin is -1, must be zero or positive [m]");
  EXPECT_EQ(making_with({.friction = -0.5}), "soft body: friction is -0.5, must be zero or positive");
  EXPECT_EQ(making_with({.pinned = {2, 13}}), "soft body: pinned node 13 is outside the 13 vertices");
  EXPECT_EQ(making_with({.pinned = {-1}}), "soft body: pinned node -1 is outside the 13 vertices");
}

TEST_P(Refused, MeshesWithoutVerticesOrWithLooseOnes) {
  EXPECT_EQ(refusal([&] { make_soft_body(sim.info(), TetMesh{}); }), "soft body: the mesh has no vertices");
  TetMesh loose = ball;
  loose.vertices.conservativeResize(3, 14);
  loose.vertices.col(13).setZero();
  EXPECT_EQ(refusal([&] { make_soft_body(sim.info(), loose, {.equal_masses = false}); }),
            "soft body: node 13 has mass 0 kg: no tetrahedron of the mesh holds it");
}

TEST_P(Refused, ForcesOutOfRange) {
  EXPECT_EQ(refusal([] { DeformablePenaltyForce(-1.0); }), "force: damping_time is -1, must be zero or positive [s]");
  EXPECT_EQ(refusal([] { DeformablePenaltyForce force{Real(nan)}; }),
            "force: damping_time is nan, must be zero or positive [s]");
  DeformablePenaltyForce force;
  btSoftBody& body = add_ball();
  EXPECT_EQ(refusal([&] { force.attach(body, PotentialField(Eigen::Matrix3Xd::Zero(3, 5))); }),
            "attach: the field has 5 particles, the soft body 13 nodes");
}

INSTANTIATE_TEST_SUITE_P(World, Refused, both_worlds(), param_name);

// Masses: a share of the volume for each node, or the same for all.
class MadeBody : public WorldTest {};

TEST_P(MadeBody, WeighsWhatItWasTold) {
  const TetMesh ball = make_ball(0.25, 2);
  for (const bool equal : {true, false}) {
    const auto body = make_soft_body(sim.info(), ball, {.mass = 3, .equal_masses = equal});
    ASSERT_EQ(body->m_nodes.size(), ball.vertices.cols());
    Real mass = 0, least = 1e9, most = 0;
    for (int i = 0; i < body->m_nodes.size(); ++i) {
      const Real m = 1 / Real(body->m_nodes[i].m_im);
      mass += m;
      least = std::min(least, m);
      most = std::max(most, m);
    }
    EXPECT_NEAR(mass, 3, limit(1e-12, 1e-5));
    EXPECT_EQ(most / least > 1.1, !equal);
    EXPECT_EQ(body->m_faces.size(), static_cast<int>(boundary_faces(ball.tetrahedra).size()));
    EXPECT_EQ(body->m_links.size() + body->m_tetras.size(), 0);
  }
}

INSTANTIATE_TEST_SUITE_P(World, MadeBody, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
