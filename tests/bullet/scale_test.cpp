// The same body at other sizes: in units of its size L, of sqrt(L / g) and of rho L³ all should happen alike.
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

class Scale : public WorldTest {};
INSTANTIATE_TEST_SUITE_P(World, Scale, both_worlds(), param_name);

struct Fall {
  std::vector<Real> heights;  // of the middle, above what it lies on at last, in sizes
  Real gap = 0;               // below it at the end, in sizes
};

// A cube of jelly falls by half its size onto a plane.
Fall fall(WorldKind kind, Real size) {
  Simulation sim(kind);
  sim.set_gravity({0, -9.81, 0});
  const Material jelly{.young = 2e5 * size, .poisson = 0.3, .damping = 0.01 * std::sqrt(size)};
  const TetMesh mesh = make_box(Vector3::Constant(size), {4, 4, 4});
  // The default, but for what is larger than a metre.
  const std::optional<Real> margin = size > 1 ? std::optional<Real>(0.02 * size) : std::nullopt;
  btSoftBody& body = sim.add(make_soft_body(sim.info(), mesh, jelly, {.margin = margin}));
  body.translate(to_bullet(Vector3(0, 0.5 * size, 0)));
  sim.penalty().attach(body, make_elastic_field(mesh.vertices, mesh.tetrahedra, jelly));
  btStaticPlaneShape plane(btVector3(0, 1, 0), 0);
  btRigidBody ground(0, nullptr, &plane);
  sim.world().addRigidBody(&ground);
  Fall result;
  for (int step = 0; step < 240; ++step) {
    sim.step(std::sqrt(size) / 60);
    if (step % 20 == 19) result.heights.push_back(center_of_mass(sim.penalty().particles(body)).y() / size);
  }
  result.gap = lowest(body) / size;
  sim.world().removeRigidBody(&ground);
  return result;
}

TEST_P(Scale, ACubeFallsAndLiesAlikeFromAMillimetreToAHundredMetres) {
  const Fall of_a_metre = fall(GetParam(), 1);
  for (const Real size : {1e-3, 1e-2, 0.1, 10.0, 100.0}) {
    SCOPED_TRACE(size);
    const Fall fallen = fall(GetParam(), size);
    for (std::size_t k = 0; k < fallen.heights.size(); ++k)
      EXPECT_NEAR(fallen.heights[k], of_a_metre.heights[k], 1e-3) << k;
    EXPECT_NEAR(fallen.gap, 0.02, 1e-3) << "it lies a margin above the plane";
  }
}

TEST_P(Scale, DecidesTheMarginUnlessThatIsGiven) {
  const auto margin = [&](const Vector3& size, const SoftBodyOptions& options = {}) {
    return Real(make_soft_body(sim.info(), make_box(size, {1, 1, 1}), options)->getCollisionShape()->getMargin());
  };
  EXPECT_NEAR(margin({0.01, 0.005, 0.002}), 2e-4, 1e-10);
  EXPECT_NEAR(margin({0.01, 3, 0.01}), 0.02, 1e-8);
  EXPECT_NEAR(margin({0.01, 0.01, 0.01}, {.margin = 0.004}), 0.004, 1e-9);
  TetMesh point = make_box({1, 1, 1}, {1, 1, 1});
  point.vertices.setOnes();  // a start that says nothing
  EXPECT_NEAR(Real(make_soft_body(sim.info(), point)->getCollisionShape()->getMargin()), 0.02, 1e-8);
}

}  // namespace
}  // namespace penalty::testing
