// Kinds of any number of points, and the user's own, evaluate without allocating.
#include <gtest/gtest.h>

#include "math/allocations.h"
#include "math/random.h"
#include "penalty/kinds/enclosed_volume.h"
#include "penalty/kinds/shape_match.h"
#include "penalty/kinds/user_constraint.h"

namespace penalty::testing {
namespace {

constexpr auto sum_of_lengths = [](const auto& p) {
  auto sum = p.col(0).norm();
  for (Eigen::Index i = 1; i < p.cols(); ++i) sum += (p.col(i) - p.col(i - 1)).norm();
  return sum;
};

// Allocations of a second, third .. call.
template <class Call>
long allocations(const Call& call) {
  call();
  const long before = num_allocations;
  for (int k = 0; k < 5; ++k) call();
  return num_allocations - before;
}

TEST(KindAllocation, IsCounted) {
  const auto allocate = [](std::size_t size) { return std::string(size, 'a'); };
  std::size_t size = 100;
  EXPECT_GE(allocations([&] { size += allocate(size).find('b') == std::string::npos; }), 5);
}

TEST(KindAllocation, EnclosedVolumeNeedsNone) {
  const Points<dynamic> p = Random(1).vectors<dynamic>(4, 1);
  const EnclosedVolume kind = EnclosedVolume({{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}).at_rest(p);
  Gradient<dynamic> g(3, 4);
  EXPECT_EQ(allocations([&] { kind.value_and_gradient(p, g); }), 0);
  EXPECT_EQ(allocations([&] { EXPECT_LT(kind.value(p), 1); }), 0);
  EXPECT_EQ(allocations([&] { kind.visit_hessian_blocks(p, [](int, int, const Matrix3&) {}); }), 0);
  EXPECT_EQ(allocations([&] { EnclosedVolume copy = kind; }), 0);  // NOLINT: the copy is what is tested
}

TEST(KindAllocation, ShapeMatchNeedsNone) {
  const Points<dynamic> rest = Random(1).vectors<dynamic>(8, 1), p = Random(2).vectors<dynamic>(8, 1);
  const ShapeMatch kind = ShapeMatch().at_rest(rest);
  Gradient<dynamic> g(3, 8);
  Points<dynamic> v = Random(3).vectors<dynamic>(8, 1);
  const std::vector<Real> inverse_masses(8, 2);
  for (const Points<dynamic>& points : {p, Points<dynamic>(-rest)})  // the quick way to the rotation, and the safe one
    EXPECT_EQ(allocations([&] { kind.energy_and_gradient(points, g); }), 0);
  EXPECT_EQ(allocations([&] { EXPECT_GT(kind.energy(p), 0); }), 0);
  EXPECT_EQ(allocations([&] { kind.damp(p, inverse_masses, 1, v); }), 0);
  EXPECT_EQ(allocations([&] { kind.damping_force(p, v, 1, g); }), 0);
}

TEST(KindAllocation, UserConstraintsNeedNone) {
  const auto count = []<int n>(const auto& prototype, const Points<n>& p) {
    const auto kind = prototype.at_rest(p);
    Gradient<n> g(3, p.cols());
    return allocations([&] { EXPECT_EQ(kind.value_and_gradient(p, g), 0); });
  };
  const Points<4> p = Random(1).vectors<4>(4, 1);
  const Points<dynamic> any = p;
  EXPECT_EQ(count(differentiated_constraint<4>(sum_of_lengths), p), 0);
  EXPECT_EQ(count(difference_constraint<4>(sum_of_lengths), p), 0);
  EXPECT_EQ(count(differentiated_constraint<dynamic>(sum_of_lengths), any), 0);
  EXPECT_EQ(count(difference_constraint<dynamic>(sum_of_lengths), any), 0);
  const auto overwrite = [](const Points<dynamic>& q, Gradient<dynamic>& g) { g = q; };
  EXPECT_EQ(count(user_constraint<dynamic>(sum_of_lengths, overwrite), any), 0);
  const auto fixed = differentiated_constraint<4>(sum_of_lengths).at_rest(p);
  EXPECT_EQ(allocations([&] { EXPECT_GT(fixed.hessian(p).norm(), 0); }), 0);
}

}  // namespace
}  // namespace penalty::testing
