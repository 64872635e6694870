// What lies comes to rest with default settings.
#include <cmath>

#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

constexpr Material jelly{.young = 1e6, .poisson = 0.35};

class Settling : public WorldTest {
 protected:
  void SetUp() override {
    sim.set_gravity({0, -g, 0});
    sim.add_ground();
  }

  void add(const TetMesh& mesh, const Vector3& shift) {
    btSoftBody& body = sim.add(make_soft_body(sim.info(), moved(mesh, shift), jelly));
    sim.penalty().attach(body, make_elastic_field(mesh.vertices, mesh.tetrahedra, jelly));
    bodies_.push_back(&body);
  }

  // In a frame, from positions [m/s].
  Real largest_motion() {
    std::vector<PackedVectors> before;
    before.reserve(bodies_.size());
    for (const btSoftBody* body : bodies_) before.push_back(sim.penalty().particles(*body).positions);
    sim.step(frame);
    Real largest = 0;
    for (std::size_t k = 0; k < bodies_.size(); ++k)
      largest = std::max(
          largest, (sim.penalty().particles(*bodies_[k]).positions - before[k]).colwise().norm().maxCoeff() / frame);
    return largest;
  }

  void expect_to_lie_after(Real duration) {
    sim.step(frame, static_cast<int>(std::lround(duration / frame)));
    for (int k = 0; k < 60; ++k) EXPECT_LT(largest_motion(), 0.005) << "frame " << k;
  }

 private:
  std::vector<btSoftBody*> bodies_;
};

TEST_P(Settling, OfAJellyTowerTakesThreeSeconds) {
  add(make_box({1, 3, 1}, {3, 9, 3}), {0, 0.05, 0});
  expect_to_lie_after(3);
}

TEST_P(Settling, OfThreeBoxesOnEachOtherTakesThreeSeconds) {
  const TetMesh box = make_box({1, 1, 1}, {3, 3, 3});
  for (int k = 0; k < 3; ++k) add(box, {0.05 * (k % 2), 0.05 + 1.05 * k, 0.03 * k});
  expect_to_lie_after(3);
}

INSTANTIATE_TEST_SUITE_P(Worlds, Settling, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
