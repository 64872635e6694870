// Fields that change while the world runs: targets, breaking, a kind of one's own; the ledger that is read between
// steps.
#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

class Editing : public WorldTest {};

// A field in use is changed, not replaced: the solver keeps what it knows of it.
static_assert(
    !std::is_assignable_v<decltype(std::declval<AttachedBodies&>().edit(std::declval<btSoftBody&>())), PotentialField>);

// A kind that is not part of the library, in fifteen lines: the sum of the squared sides of a triangle, relative.
struct Girth {
  static constexpr std::string_view name = "girth";
  static constexpr int num_points = 3;
  static Girth at_rest(const Points<3>& p) { return {1 / sum(p)}; }
  static Real sum(const Points<3>& p) {
    return (p.col(1) - p.col(0)).squaredNorm() + (p.col(2) - p.col(1)).squaredNorm() +
           (p.col(0) - p.col(2)).squaredNorm();
  }
  Real value(const Points<3>& p) const { return sum(p) * scale - 1; }
  Gradient<3> gradient(const Points<3>& p) const {
    Gradient<3> g;
    for (int k = 0; k < 3; ++k) g.col(k) = 2 * scale * (3 * p.col(k) - p.rowwise().sum());
    return g;
  }
  Real scale;  // [1/m²]
};

TEST_P(Editing, AKindOfOnesOwnPullsTheBodyBackToItsRestShape) {
  const TetMesh mesh = make_ball(0.5, 3);
  PotentialField field(mesh.vertices);
  field.add<Girth>(faces_of(mesh.tetrahedra), 5);
  btSoftBody& body = sim.add(make_soft_body(sim.info(), mesh));
  sim.penalty().attach(body, std::move(field), {.step = {.drag = 2}});
  for (int i = 0; i < body.m_nodes.size(); ++i) body.m_nodes[i].m_x *= btScalar(1.05);
  sim.step(frame);
  const Real start = sim.penalty().field(body).energy(sim.penalty().particles(body).positions);
  ASSERT_GT(start, 0.5);
  sim.step(frame, 300);
  const auto& particles = sim.penalty().particles(body);
  EXPECT_LT(sim.penalty().field(body).energy(particles.positions), 1e-3 * start);
  EXPECT_LT(linear_momentum(particles).norm(), limit(1e-12, 1e-6));
}

TEST_P(Editing, TargetsWakeTheBodyAndMoveIt) {
  const TetMesh mesh = make_box({1, 0.2, 0.2}, {10, 2, 2});
  btSoftBody& body = sim.add_jelly(mesh, {.attach = {.step = {.damping_time = 0.02}}});
  sim.step(frame);
  body.forceActivationState(ISLAND_SLEEPING);
  sim.step(frame, 10);
  ASSERT_FALSE(body.isActive());
  const PackedVectors before = sim.penalty().particles(body).positions;
  sim.penalty().edit(body).find<Length>()->set_targets(-0.2);
  EXPECT_TRUE(body.isActive());
  sim.step(frame, 240);
  const auto& x = sim.penalty().particles(body).positions;
  const auto length = [](const PackedVectors& p) { return p.row(0).maxCoeff() - p.row(0).minCoeff(); };
  EXPECT_LT(length(x), 0.97 * length(before));
  EXPECT_GT(sim.penalty().flows(body).changes, 0) << "the muscle does the work";
}

TEST_P(Editing, AStifferElementGetsItsSubsteps) {
  const TetMesh mesh = make_box({1, 0.2, 0.2}, {5, 1, 1});
  btSoftBody& body = sim.add_jelly(mesh, {.stiffness = 1});
  sim.step(frame);
  const int before = sim.penalty().report(body).substeps;
  sim.penalty().edit(body).find<Length>()->set_stiffness(7, 1e4);
  sim.step(frame);
  EXPECT_GT(sim.penalty().report(body).substeps, 10 * before);
  EXPECT_EQ(sim.penalty().report(body).retries, 0);
}

TEST_P(Editing, LedgerBalancesWhileABodyTears) {
  const TetMesh mesh = make_box({1, 0.2, 0.2}, {10, 2, 2});
  PotentialField springs(mesh.vertices);
  springs.add<Length>(edges_of(mesh.tetrahedra), 2).set_breaking({.upper = 0.4});
  btSoftBody& body = sim.add(make_soft_body(sim.info(), mesh));
  sim.penalty().attach(body, std::move(springs), {.step = {.safety = 0.2}});
  const Batch<Length>& batch = *sim.penalty().field(body).find<Length>();
  for (int i = 0; i < body.m_nodes.size(); ++i)
    body.m_nodes[i].m_v = btVector3(60 * (body.m_nodes[i].m_x.x() - btScalar(0.5)), 0, 0);
  sim.penalty().synchronize(body);
  Real start = -1, largest = 0, worst = 0;
  const auto energy = [&] {
    return sim.penalty().field(body).energy(sim.penalty().particles(body).positions) +
           kinetic_energy(sim.penalty().particles(body));
  };
  start = energy();
  for (int k = 0; k < 60; ++k) {
    sim.step(frame);
    const EnergyFlows& flows = sim.penalty().flows(body);
    largest = std::max(largest, energy());
    worst = std::max(worst, std::abs(energy() - start - flows.received() + flows.lost()));
  }
  std::size_t broken = 0;
  for (const LedgerEntry& entry : sim.penalty().ledger(body)) broken += entry.num_elements - entry.num_enabled;
  EXPECT_GT(broken, 20u);
  EXPECT_EQ(broken, batch.breaks().size());
  EXPECT_LT(worst / std::max(largest, start), 0.01);
  EXPECT_GT(sim.penalty().flows(body).inelastic, 0);
}

TEST_P(Editing, ForcesAreThoseOfTheField) {
  btSoftBody& body = sim.add_jelly(make_box({1, 1, 1}, {2, 2, 2}));
  body.m_nodes[0].m_x += btVector3(0.1f, 0, 0);
  sim.penalty().synchronize(body);
  const PackedVectors f = sim.penalty().forces(body);
  EXPECT_LT(f(0, 0), -1);
  EXPECT_LT(f.rowwise().sum().norm() / f.colwise().norm().sum(), 1e-14);
}

INSTANTIATE_TEST_SUITE_P(World, Editing, both_worlds(), param_name);

class Attachments : public WorldTest {
 protected:
  static int nearest(const btSoftBody& body, const Vector3& place) {
    int best = 0;
    for (int i = 0; i < body.m_nodes.size(); ++i)
      if ((to_vector(body.m_nodes[i].m_x) - place).norm() < (to_vector(body.m_nodes[best].m_x) - place).norm())
        best = i;
    return best;
  }
};

TEST_P(Attachments, TieTwoSoftBodiesAndARigidOneAndKeepMomentum) {
  btSoftBody& left = sim.add_jelly(make_box({1, 0.3, 0.3}, {5, 2, 2}));
  btSoftBody& right = sim.add_jelly(make_box({1, 0.3, 0.3}, {4, 1, 1}), {.stiffness = 4, .shift = {1.5, 0, 0}});
  btRigidBody& box = sim.add_box({0.2, 0.2, 0.2}, 2, {3.5, 0.15, 0.15});
  const Vector3 a(1, 0.15, 0.15), b(1.5, 0.15, 0.15), c(2.5, 0.15, 0.15), d(3.3, 0.15, 0.15);
  const int ia = nearest(left, a), ib = nearest(right, b), ic = nearest(right, c);
  Eigen::Matrix3Xd rest(3, 4);
  rest << to_vector(left.m_nodes[ia].m_x), to_vector(right.m_nodes[ib].m_x), to_vector(right.m_nodes[ic].m_x), d;
  PotentialField ropes(rest);
  ropes.add<Length>(std::vector<Edge>{{0, 1}, {2, 3}}, 20);
  const int coupling = sim.penalty().couple({CouplingPoint::at_node(left, ia), CouplingPoint::at_node(right, ib),
                                             CouplingPoint::at_node(right, ic), CouplingPoint::on(box, {-0.2, 0, 0})},
                                            std::move(ropes), 0.01);
  box.setLinearVelocity({3, 1, 0});
  const Totals before = sim.totals();
  Real momentum_drift = 0, angular_drift = 0;
  for (int k = 0; k < 120; ++k) {
    sim.step(frame);
    const Totals now = sim.totals();
    momentum_drift = std::max(momentum_drift, (now.momentum - before.momentum).norm() / before.momentum.norm());
    angular_drift = std::max(angular_drift,
                             (now.angular_momentum - before.angular_momentum).norm() / before.angular_momentum.norm());
    EXPECT_LE(now.energy + sim.penalty().coupling_energy(coupling), before.energy * 1.01);
  }
  EXPECT_LT(momentum_drift, limit(1e-12, 1e-5));
  EXPECT_LT(angular_drift, limit(1e-12, 1e-5));
  EXPECT_GT(linear_momentum(sim.penalty().particles(left)).norm(), 0.1) << "the first felt the pull on the last";
}

TEST_P(Attachments, ABodyHangsOnAKinematicHandThatMoves) {
  sim.set_gravity({0, -9.81, 0});
  btSoftBody& body = sim.add_jelly(make_ball(0.3, 2), {.attach = {.step = {.damping_time = 0.02, .drag = 0.5}}});
  btRigidBody& hand = sim.add_box({0.05, 0.05, 0.05}, 0, {0, 0.8, 0});
  hand.setCollisionFlags(hand.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT |
                         btCollisionObject::CF_NO_CONTACT_RESPONSE);
  hand.setActivationState(DISABLE_DEACTIVATION);
  const int top = nearest(body, {0, 0.3, 0});
  Eigen::Matrix3Xd rest(3, 2);
  rest << to_vector(body.m_nodes[top].m_x), Vector3(0, 0.8, 0);
  PotentialField rope(rest);
  rope.add<Length>(std::vector<Edge>{{0, 1}}, 100).set_free_play(-infinite, 0);
  const int coupling = sim.penalty().couple({CouplingPoint::at_node(body, top), CouplingPoint::on(hand, {0, 0, 0})},
                                            std::move(rope), 0.01);
  sim.step(frame, 600);
  // At rest the rope carries the weight of 1 kg.
  const Real pull = [&] {
    const Real length = (to_vector(body.m_nodes[top].m_x) - Vector3(0, 0.8, 0)).norm(),
               rest_length = (rest.col(1) - rest.col(0)).norm();
    return 100 * (length / rest_length - 1) / rest_length;
  }();
  EXPECT_NEAR(pull, 9.81, 0.05);
  sim.penalty().uncouple(coupling);
  sim.step(frame, 30);
  EXPECT_LT(center_of_mass(sim.penalty().particles(body)).y(), -0.5) << "falls when let go";
}

TEST_P(Attachments, HoldAPointBetweenNodes) {
  // 1 kg hangs by a point of its upper side where no node is.
  sim.set_gravity({0, -9.81, 0});
  btSoftBody& body = sim.add_jelly(make_box({1, 1, 1}, {2, 2, 2}),
                                   {.stiffness = 100, .attach = {.step = {.damping_time = 0.02, .drag = 0.5}}});
  btRigidBody& hook = sim.add_box({0.01, 0.01, 0.01}, 0, {3, 3, 3});
  const int corners[] = {nearest(body, {0, 1, 0}), nearest(body, {1, 1, 0}), nearest(body, {0.5, 1, 1})};
  const WeightedPoint point{{corners[0], corners[1], corners[2]}, {0.3, 0.3, 0.4}, 3};
  const auto place = [&] {
    Vector3 sum = Vector3::Zero();
    for (int k = 0; k < 3; ++k) sum += point.weights[k] * to_vector(body.m_nodes[corners[k]].m_x);
    return sum;
  };
  const Vector3 start = place();
  Eigen::Matrix3Xd rest(3, 2);
  rest << start, start;
  PotentialField tie(rest);
  tie.add(Attachment::of_length(1), std::vector<Edge>{{0, 1}}, 5000);  // [N/m]
  sim.penalty().couple({CouplingPoint::between(body, point), CouplingPoint::on(hook, start - Vector3(3, 3, 3))},
                       std::move(tie), 0.01);
  sim.step(frame, 900);
  EXPECT_NEAR((place() - start).y(), -9.81 / 5000, 0.02 * 9.81 / 5000);
  EXPECT_LT((place() - start).cwiseProduct(Vector3(1, 0, 1)).norm(), 2e-4);
  EXPECT_GT(start.y() - center_of_mass(sim.penalty().particles(body)).y(), 0.3) << "below it";
}

TEST_P(Attachments, RefuseWhatCannotBeAndSayWhich) {
  btSoftBody& body = sim.add_jelly(make_box({1, 1, 1}, {1, 1, 1}));
  btRigidBody& box = sim.add_box({0.1, 0.1, 0.1}, 1, {0, 3, 0});
  const auto refusal = [&](const std::vector<CouplingPoint>& points, int particles) {
    return complaint<std::invalid_argument>(
        [&] { sim.penalty().couple(points, PotentialField(Eigen::Matrix3Xd::Zero(3, particles))); });
  };
  const CouplingPoint node = CouplingPoint::at_node(body, 0), rigid = CouplingPoint::on(box, {0, 0, 0});
  EXPECT_EQ(refusal({node, rigid}, 3), "couple: the field has 3 particles for 2 points");
  EXPECT_EQ(refusal({node, CouplingPoint::at_node(body, 8)}, 2), "couple: point 1: index 8 is outside the 8 nodes");
  EXPECT_EQ(refusal({node, node}, 2), "couple: point 1: is the same as point 0");
  EXPECT_EQ(refusal({rigid}, 1), "couple: none of the 1 points is of a soft body");
  EXPECT_EQ(refusal({node, CouplingPoint{}}, 2), "couple: point 1: must be of one body, soft or rigid");
  const std::unique_ptr<btSoftBody> stranger = make_soft_body(sim.info(), make_box({1, 1, 1}, {1, 1, 1}));
  EXPECT_EQ(refusal({CouplingPoint::at_node(*stranger, 0)}, 1), "couple: point 0: its soft body is not attached");
  EXPECT_EQ(complaint<std::invalid_argument>([&] { sim.penalty().uncouple(5); }), "there is no coupling 5");
}

TEST_P(Attachments, GoWithTheSoftBody) {
  btSoftBody& first = sim.add_jelly(make_box({1, 1, 1}, {1, 1, 1}));
  btSoftBody& second = sim.add_jelly(make_box({1, 1, 1}, {1, 1, 1}), {.shift = {3, 0, 0}});
  PotentialField rope((Eigen::Matrix3Xd(3, 2) << 0, 3, 0, 0, 0, 0).finished());
  rope.add<Length>(std::vector<Edge>{{0, 1}}, 10);
  const int coupling =
      sim.penalty().couple({CouplingPoint::at_node(first, 0), CouplingPoint::at_node(second, 0)}, std::move(rope));
  sim.step(frame);
  sim.remove(second);
  sim.step(frame);
  EXPECT_THROW(sim.penalty().coupling_field(coupling), std::invalid_argument);
  EXPECT_NO_THROW(sim.penalty().uncouple(coupling)) << "there is nothing left to do";
}

INSTANTIATE_TEST_SUITE_P(World, Attachments, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
