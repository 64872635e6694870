#include "penalty/kinds/enclosed_volume.h"

#include <limits>
#include <map>
#include <numbers>
#include <set>

#include "kinds/samples.h"
#include "penalty/math/finite_difference.h"

namespace penalty::testing {
namespace {

using Triangles = std::vector<EnclosedVolume::Triangle>;

struct Surface {
  Triangles triangles;
  Points<dynamic> points;
};

// Outward faces of the tetrahedron with orthogonal legs of length 1.
Surface corner() {
  Surface s{{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}, Points<dynamic>(3, 4)};
  s.points << Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0), Vector3(0, 0, 1);
  return s;
}

Surface octahedron() {
  Surface s{{}, Points<dynamic>(3, 6)};
  s.points << Vector3(1, 0, 0), Vector3(-1, 0, 0), Vector3(0, 1, 0), Vector3(0, -1, 0), Vector3(0, 0, 1),
      Vector3(0, 0, -1);
  for (const int x : {0, 1})
    for (const int y : {2, 3})
      for (const int z : {4, 5}) {
        const bool even = (x + y + z) % 2 == 0;
        s.triangles.push_back({x, even ? y : z, even ? z : y});
      }
  return s;
}

// Every triangle into four, new points on the unit sphere.
Surface refined(const Surface& coarse) {
  std::vector<Vector3> points;
  points.reserve(coarse.points.cols());
  for (Eigen::Index i = 0; i < coarse.points.cols(); ++i) points.emplace_back(coarse.points.col(i));
  std::map<std::pair<int, int>, int> middles;
  const auto middle = [&](int a, int b) {
    const auto [entry, is_new] = middles.emplace(std::minmax(a, b), static_cast<int>(points.size()));
    if (is_new) points.push_back((points[a] + points[b]).normalized());
    return entry->second;
  };
  Surface fine;
  for (const auto& [a, b, c] : coarse.triangles) {
    const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    fine.triangles.insert(fine.triangles.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  fine.points.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) fine.points.col(i) = points[i];
  return fine;
}

Surface sphere(int refinements) {
  Surface s = octahedron();
  for (int k = 0; k < refinements; ++k) s = refined(s);
  return s;
}

Points<dynamic> noisy(const Points<dynamic>& points, unsigned seed) {
  return points + Random(seed).vectors<dynamic>(points.cols(), 0.2);
}

TEST(EnclosedVolume, OfSolidsThatAreKnown) {
  const Surface tetrahedron = corner(), eight = octahedron();
  EXPECT_DOUBLE_EQ(EnclosedVolume(tetrahedron.triangles).signed_volume(tetrahedron.points), 1.0 / 6);
  EXPECT_DOUBLE_EQ(EnclosedVolume(eight.triangles).signed_volume(eight.points), 4.0 / 3);
  const Surface ball = sphere(5);  // 8192 triangles: inscribed, so a little less
  const Real ratio = EnclosedVolume(ball.triangles).signed_volume(ball.points) / (4 * std::numbers::pi / 3);
  EXPECT_LT(ratio, 1);
  EXPECT_GT(ratio, 0.998);
}

TEST(EnclosedVolume, GrowsAsTheCubeOfTheScale) {
  const Surface s = sphere(2);
  const EnclosedVolume kind = EnclosedVolume(s.triangles).at_rest(s.points);
  for (const Real scale : {-1.0, 0.0, 0.5, 1.0, 1.5, 2.0})
    EXPECT_NEAR(kind.value(scale * s.points), scale * scale * scale - 1, 1e-14) << scale;
}

TEST(EnclosedVolume, GradientOfAPointIsAThirdOfTheAreaVectorsAround) {
  // Moving the apex (0, 0, 1) up by t raises V = 1/6 by t/6; V0 = 1/6.
  const Surface s = corner();
  const Gradient<dynamic> gradient = EnclosedVolume(s.triangles).at_rest(s.points).gradient(s.points);
  EXPECT_LT((gradient.col(3) - Vector3(0, 0, 1)).norm(), 1e-15);
  EXPECT_LT((gradient.col(0) + Vector3(1, 1, 1)).norm(), 1e-15);
}

TEST(EnclosedVolume, GradientAndHessianAreTheDerivatives) {
  WorstError gradient_error, hessian_error, asymmetry;
  for (unsigned seed = 0; seed < 40; ++seed) {
    Surface s = seed % 2 == 0 ? sphere(1) : corner();
    if (seed % 4 >= 2)
      for (auto& t : s.triangles) std::swap(t[0], t[1]);  // V0 < 0
    const Real size = std::pow(10.0, Random(seed).uniform(-3, 3));
    const EnclosedVolume kind = EnclosedVolume(s.triangles).at_rest(size * s.points);
    ASSERT_EQ(kind.rest_volume() < 0, seed % 4 >= 2);
    const Points<dynamic> p = size * noisy(s.points, seed);
    const Gradient<dynamic> gradient = kind.gradient(p);
    ASSERT_GT(gradient.norm() * size, 0.1);
    gradient_error.see(relative_error(central_difference_gradient<dynamic>([&](const auto& q) { return kind.value(q); },
                                                                           p, 1e-5 * size),
                                      gradient),
                       seed);
    const Hessian<dynamic> hessian = kind.hessian(p);
    ASSERT_GT(hessian.norm() * size * size, 0.1);
    hessian_error.see(relative_error(central_difference_hessian<dynamic>(
                                         [&](const auto& q) { return kind.gradient(q); }, p, 1e-5 * size),
                                     hessian),
                      seed);
    asymmetry.see(relative_error(hessian.transpose(), hessian), seed);
  }
  gradient_error.expect_below(1e-8, "gradient");
  hessian_error.expect_below(1e-8, "hessian");
  asymmetry.expect_below(1e-15, "asymmetry");
}

TEST(EnclosedVolume, ValueAndGradientTogetherOverwriteAndAgree) {
  const Surface s = sphere(1);
  const EnclosedVolume kind = EnclosedVolume(s.triangles).at_rest(s.points);
  const Points<dynamic> p = noisy(s.points, 7);
  Gradient<dynamic> gradient = Gradient<dynamic>::Constant(3, p.cols(), std::numeric_limits<Real>::quiet_NaN());
  EXPECT_NEAR(kind.value_and_gradient(p, gradient), kind.value(p), 1e-14);
  EXPECT_EQ(gradient, kind.gradient(p));
}

TEST(EnclosedVolume, HasNoNetForceAndNoNetTorqueFarFromTheOrigin) {
  WorstError force, torque, value;
  const Surface s = sphere(2);
  for (unsigned seed = 0; seed < 50; ++seed) {
    const Points<dynamic> p = noisy(s.points, seed).colwise() + 1e4 * Random(seed).direction();
    const EnclosedVolume kind = EnclosedVolume(s.triangles).at_rest(s.points);
    const Gradient<dynamic> gradient = kind.gradient(p);
    force.see(net_force<dynamic>(gradient), seed);
    torque.see(net_torque<dynamic>(p, gradient), seed);
    const Points<dynamic> near = p.colwise() - p.col(0).eval();  // exact up to the rounding of p itself
    value.see(std::abs(kind.value(p) - kind.value(near)), seed);
  }
  force.expect_below(1e-12, "net force");
  torque.expect_below(1e-12, "net torque");
  value.expect_below(1e-14, "dependence on the origin");
}

TEST(EnclosedVolume, PatternHoldsEveryBlockOnceAndNothingElse) {
  const Surface s = sphere(1);
  const EnclosedVolume kind = EnclosedVolume(s.triangles).at_rest(s.points);
  std::set<std::pair<int, int>> pattern, blocks;
  kind.visit_hessian_pattern([&](int i, int j) { EXPECT_TRUE(pattern.emplace(i, j).second) << i << " " << j; });
  kind.visit_hessian_blocks(noisy(s.points, 3), [&](int i, int j, const Matrix3&) { blocks.emplace(i, j); });
  EXPECT_EQ(pattern, blocks);
  EXPECT_EQ(pattern.size(), 3 * s.triangles.size());  // two directions of 3/2 edges a triangle
  for (const auto& [i, j] : pattern) EXPECT_TRUE(i != j && pattern.contains({j, i}));
}

TEST(EnclosedVolume, CopiesShareTheTriangles) {
  const Surface s = corner();
  const EnclosedVolume prototype(s.triangles), kind = prototype.at_rest(s.points);
  const EnclosedVolume copy = kind;  // NOLINT: the copy is what is tested
  EXPECT_EQ(&prototype.triangles(), &kind.triangles());
  EXPECT_EQ(&copy.triangles(), &kind.triangles());
}

TEST(EnclosedVolume, IsFiniteForCollapsedSurfaces) {
  const Surface s = octahedron();
  const EnclosedVolume kind = EnclosedVolume(s.triangles).at_rest(s.points);
  Points<dynamic> flat = s.points, line = s.points;
  flat.row(2).setZero();
  line.bottomRows<2>().setZero();
  for (const Points<dynamic>& p : {flat, line, Points<dynamic>(Points<dynamic>::Ones(3, 6))}) {
    EXPECT_DOUBLE_EQ(kind.value(p), -1);
    EXPECT_TRUE(kind.gradient(p).allFinite());
    EXPECT_TRUE(kind.hessian(p).allFinite());
  }
  EXPECT_GT(kind.gradient(flat).norm(), 0.1);  // blown up again from flat
}

TEST(EnclosedVolume, RefusesSurfacesThatAreNotClosedAndNamesTheEdge) {
  const auto refusal = [](Triangles triangles) {
    return complaint<std::invalid_argument>([&] { EnclosedVolume kind(std::move(triangles)); });
  };
  EXPECT_EQ(refusal({}), "enclosed volume: no triangles");
  EXPECT_EQ(refusal({{0, 2, 1}, {0, 1, 3}, {0, 3, 2}}),
            "enclosed volume: edge 2-1 of triangle 0 has no triangle on its other side");
  EXPECT_EQ(refusal({{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 3, 2}}),
            "enclosed volume: edge 1-3 is in triangle 1 and, in the same direction, in 3");
  EXPECT_EQ(refusal({{0, 2, 2}}), "enclosed volume: edge 2-2 of triangle 0 joins a point to itself");
  EXPECT_EQ(refusal({{0, -4, 2}}), "enclosed volume: index -4 in triangle 0");
}

TEST(EnclosedVolume, RefusesBadRestShapesAndSaysWhy) {
  const Surface s = octahedron();
  const EnclosedVolume prototype(s.triangles);
  const auto refusal = [&](const Points<dynamic>& rest) {
    return complaint<std::invalid_argument>([&] { prototype.at_rest(rest); });
  };
  EXPECT_EQ(refusal(s.points.leftCols(5)), "enclosed volume: 5 points at rest, the triangles have 6");
  EXPECT_EQ(refusal(Points<dynamic>::Ones(3, 6)), "enclosed volume: rest volume is 0");
  Points<dynamic> bad = s.points;
  bad(1, 3) = std::numeric_limits<Real>::quiet_NaN();
  EXPECT_NE(refusal(bad).find("rest volume is"), std::string::npos);
  EXPECT_NE(refusal(bad).find("nan"), std::string::npos);
  Points<dynamic> flat = s.points;
  flat.row(2).setZero();
  for (unsigned seed = 0; seed < 20; ++seed) {  // flat up to round-off
    const std::string message = refusal(Random(seed).rotation() * flat);
    EXPECT_TRUE(message.starts_with("enclosed volume: rest volume is ")) << message;
  }
}

}  // namespace
}  // namespace penalty::testing
