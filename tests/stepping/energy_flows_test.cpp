// Every joule is accounted for: what a body has is what it had, plus what it received, less what it lost.
#include "stepping/islands.h"

namespace penalty::testing {
namespace {

// The largest deviation of the balance over a run, relative to the largest energy in it.
class Balance {
 public:
  explicit Balance(const Body& body)
      : start_(body.body.field->energy(body.particles().positions) + kinetic_energy(body.particles())) {
    see_energy(start_);
  }
  void see(const Body& body) {
    const Real energy = body.body.field->energy(body.particles().positions) + kinetic_energy(body.particles());
    see_energy(energy);
    const EnergyFlows& flows = body.body.flows;
    see_energy(std::abs(flows.received()));
    worst_ = std::max(worst_, std::abs(energy - (start_ + flows.received() - flows.lost())));
  }
  Real relative() const { return worst_ / largest_; }

 private:
  void see_energy(Real energy) { largest_ = std::max(largest_, energy); }
  Real start_, largest_ = 0, worst_ = 0;
};

TEST(EnergyFlows, OfABodyInFreeFallAreTheWorkOfGravity) {
  Body body = make_beam_body(1);
  body.body.gravity = {0, -9.81, 0};
  Balance balance(body);
  for (int step = 0; step < 60; ++step) {
    advance(body, 1.0 / 60);
    balance.see(body);
  }
  EXPECT_NEAR(body.body.flows.constant_forces, 4000 * 9.81 * 9.81 / 2, 1e-6);
  EXPECT_LT(balance.relative(), 1e-12);
}

TEST(EnergyFlows, BalanceInADampedDropOnTheGround) {
  Body body = make_beam_body(1, {.young = 1e5, .poisson = 0.4});
  body.body.gravity = {0, -9.81, 0};
  body.body.options = {.damping_time = 0.01, .drag = 0.2, .safety = 0.2, .contact_safety = 0.2};
  RigidBody ground;
  ground.position = {0, -1, 0};
  Balance balance(body);
  for (int step = 0; step < 120; ++step) {
    body.contacts.clear();
    for (int i = 0; i < body.particles().size(); ++i)
      body.touch(WeightedPoint::at_particle(i), 0, {0, 0, 0}, {0, 1, 0}, 0.5);
    RigidBody bodies[] = {ground};
    advance(body, 1.0 / 60, bodies);
    balance.see(body);
  }
  const EnergyFlows& flows = body.body.flows;
  EXPECT_GT(flows.damping, 100);
  EXPECT_GT(flows.drag, 100);
  EXPECT_GT(flows.contact_loss, 100);
  EXPECT_NEAR(flows.contacts, -flows.contact_loss,
              1e-9 * std::abs(flows.contact_loss));  // ground at rest: contacts only take
  EXPECT_LT(balance.relative(), 0.01);
  RecordProperty("balance", std::to_string(balance.relative()));
}

TEST(EnergyFlows, CountWhatTheApplicationChanges) {
  Body body = make_beam_body(1);
  advance(body, 0.01);
  body.set_velocity(3, {5, 0, 0});
  const Real given = 25 / body.particles().inverse_masses[3] / 2;
  body.field->find<Length>()->set_targets(-0.01);  // all muscles pull
  const Real stored = body.field->energy(body.particles().positions);
  body.body.positions_changed();
  advance(body, 0.01);
  EXPECT_NEAR(body.body.flows.changes, given + stored, 1e-9 * (given + stored));
}

// A chain of springs, its first particle pinned, each with its own modifiers.
Body make_chain(int links, Real stiffness, const std::function<void(ElementBatch&)>& modify) {
  Eigen::Matrix3Xd rest(3, links + 1);
  std::vector<Edge> edges;
  for (int i = 0; i <= links; ++i) {
    rest.col(i) = Vector3(i, 0, 0);
    if (i > 0) edges.push_back({i - 1, i});
  }
  PotentialField field(rest);
  modify(field.add<Length>(edges, stiffness));
  std::vector<Real> inverse_masses(links + 1, 1);
  inverse_masses[0] = 0;
  return make_body(std::move(field), std::move(inverse_masses));
}

TEST(EnergyFlows, ABodyThatHangsAtRestReceivesNothing) {
  // A light node carries a heavy one; with damping there are several blocks in a step, whose kicks come in halves.
  Body chain = make_chain(2, 400, [](ElementBatch& springs) { springs.set_damping_time(0.002); });
  chain.particles().inverse_masses[1] = 50;
  estimate_stability(chain.body);
  chain.body.gravity = {9.81, 0, 0};
  for (int step = 0; step < 6000; ++step) advance(chain, 1.0 / 60);
  const EnergyFlows before = chain.body.flows;
  for (int step = 0; step < 60; ++step) advance(chain, 1.0 / 60);
  EXPECT_LT(kinetic_energy(chain.particles()), 1e-12);
  EXPECT_NEAR(chain.body.flows.received(), before.received(), 1e-6);
  EXPECT_NEAR(chain.body.flows.lost(), before.lost(), 1e-6);
}

TEST(EnergyFlows, BalanceWhileSpringsBreak) {
  Body chain = make_chain(8, 400, [](ElementBatch& springs) { springs.set_breaking({.upper = 0.3}); });
  chain.body.options.safety = 0.1;
  for (int i = 0; i < 9; ++i) chain.set_velocity(i, {1.5 * i, 0, 0});
  Balance balance(chain);
  for (int step = 0; step < 120; ++step) {
    advance(chain, 1.0 / 60);
    balance.see(chain);
  }
  const auto& breaks = chain.field->find<Length>()->breaks();
  ASSERT_FALSE(breaks.empty());
  Real energy = 0;
  for (const Break& event : breaks) {
    energy += event.energy;
    EXPECT_GT(event.strain, 0.3);
    EXPECT_FALSE(chain.field->find<Length>()->is_enabled(event.element));
  }
  EXPECT_NEAR(chain.body.flows.inelastic, energy, 1e-9 * energy);
  EXPECT_LT(balance.relative(), 0.01);
  // Nothing is lost or counted twice: what broke and what holds are all there are.
  const std::vector<LedgerEntry> ledger = penalty::ledger(*chain.field, chain.particles().positions);
  EXPECT_EQ(ledger[0].num_enabled + breaks.size(), ledger[0].num_elements);
}

TEST(EnergyFlows, BalanceInPlasticFlowAndTheDentIsTheYieldLaws) {
  // One spring, pulled to strain 0.5 by its end, which is driven; without creep 0.1 stays elastic.
  Body chain = make_chain(1, 100, [](ElementBatch& spring) { spring.set_plasticity({.yield = 0.1}); });
  chain.particles().inverse_masses[1] = 0;
  chain.set_velocity(1, {0.5, 0, 0});
  chain.body.options.substeps = 400;
  Balance balance(chain);
  for (int step = 0; step < 60; ++step) {
    advance(chain, 1.0 / 60);
    balance.see(chain);
  }
  const Batch<Length>& spring = *chain.field->find<Length>();
  EXPECT_NEAR(spring.plastic_strain(0), 0.4, 1e-12);
  EXPECT_NEAR(chain.body.elastic_energy, 100 * 0.1 * 0.1 / 2, 1e-9);
  // K s ds: up to the yield strain it is stored, from there on all work is lost. The spring flows eight times a step,
  // so that between two flows its strain overshoots the yield strain, by half a block in the mean.
  const Real overshoot = 0.5 / (60 * 8) / 2;
  EXPECT_NEAR(chain.body.flows.driving, 0.5 + 100 * (0.1 + overshoot) * 0.4, 1e-9);
  EXPECT_NEAR(chain.body.flows.inelastic, 100 * (0.1 + overshoot) * 0.4, 1e-9);
  EXPECT_LT(balance.relative(), 1e-3);
}

TEST(EnergyGuard, RepeatsAStepWithTheModifiersAsTheyWereAtItsStart) {
  // Far too few substeps at first: attempts blow up, and their breaks and flow must not count.
  const auto run = [](int substeps) {
    Body chain = make_chain(4, 5e5, [](ElementBatch& springs) {
      springs.set_plasticity({.yield = 0.02, .creep = 5});
      springs.set_breaking({.upper = 0.5});
    });
    chain.set_position(4, {4.2, 0, 0});
    chain.body.largest_eigenvalue /= 16;  // the estimate is too low
    chain.body.options.substeps = substeps;
    advance(chain, 1.0 / 60);
    return chain;
  };
  const Body repeated = run(0), careful = run(2000);
  ASSERT_GT(repeated.body.report.retries, 0);
  ASSERT_TRUE(repeated.body.report.finite);
  EXPECT_TRUE(repeated.field->find<Length>()->breaks().empty());
  for (int e = 0; e < 4; ++e)
    EXPECT_NEAR(repeated.field->find<Length>()->plastic_strain(e), careful.field->find<Length>()->plastic_strain(e),
                0.01);
}

}  // namespace
}  // namespace penalty::testing
