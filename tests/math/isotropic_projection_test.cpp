#include "penalty/math/isotropic_projection.h"

#include <Eigen/LU>
#include <limits>

#include "math/random.h"
#include "penalty/math/finite_difference.h"
#include "penalty/math/psd_projection.h"

namespace penalty::testing {
namespace {

constexpr unsigned num_matrices = 300;

struct NamedStretches {
  std::string name;
  Vector3 s;
};

// Signed singular values, in order: those of every kind of matrix.
std::vector<NamedStretches> stretches(Random& random) {
  const Real x = random.uniform(0.5, 2), y = random.uniform(0.1, 0.5), z = random.uniform(0.01, 0.1);
  return {{"regular", {x, y, z}},
          {"reflected", {x, y, -z}},
          {"rotation", {1, 1, 1}},
          {"mirror image", {1, 1, -1}},
          {"two equal large", {x, x, y}},
          {"two equal small", {x, y, y}},
          {"two opposite", {x, y, -y}},
          {"nearly equal", {x, x * (1 - 1e-9), x * (1 - 2e-9)}},
          {"flat", {x, y, 0}},
          {"flat and round", {x, x, 0}},
          {"nearly flat", {x, y, 1e-12}},
          {"squashed", {x, 1e-7, -1e-9}},
          {"line", {x, 0, 0}},
          {"nearly a line", {x, 1e-14, 1e-16}},
          {"zero", {0, 0, 0}}};
}

void expect_decomposed(const Matrix3& f, const SignedSvd& svd, WorstError& error, unsigned seed) {
  error.see((svd.u.transpose() * svd.u - Matrix3::Identity()).norm(), seed);
  error.see((svd.v.transpose() * svd.v - Matrix3::Identity()).norm(), seed);
  EXPECT_GT(svd.u.determinant(), 0);
  EXPECT_GT(svd.v.determinant(), 0);
  EXPECT_GE(svd.s[0], svd.s[1]);
  EXPECT_GE(svd.s[1], std::abs(svd.s[2]));
  const Matrix3 product = svd.u * svd.s.asDiagonal() * svd.v.transpose();
  const Real size = f.cwiseAbs().maxCoeff();
  error.see(size > 0 ? ((product - f) / size).norm() : product.norm(), seed);
}

TEST(SignedSvd, DecomposesEveryMatrixByTwoRotations) {
  WorstError error, values;
  for (unsigned seed = 0; seed < num_matrices; ++seed) {
    Random random(seed);
    const Matrix3 u = random.rotation(), v = random.rotation();
    for (const auto& [name, s] : stretches(random)) {
      SCOPED_TRACE(name + ", seed " + std::to_string(seed));
      for (const Real unit : {1.0, 1e-6, 1e6, 1e-200, 1e200}) {
        const Matrix3 f = unit * (u * s.asDiagonal() * v.transpose());
        const SignedSvd svd = signed_svd(f);
        expect_decomposed(f, svd, error, seed);
        if (s.norm() > 0) values.see((svd.s / unit - s).norm() / s.norm(), seed);
        EXPECT_EQ(signed_singular_values(f), svd.s);
      }
      // Along the axes already, in any order and of any sign.
      for (const Matrix3& turn : {Matrix3(Matrix3::Identity()), Matrix3(Vector3(-1, 1, -1).asDiagonal())})
        for (int shift = 0; shift < 3; ++shift) {
          Matrix3 f = turn * s.asDiagonal();
          for (int k = 0; k < shift; ++k) f.col(0).swap(f.col(k + 1));
          expect_decomposed(f, signed_svd(f), error, seed);
        }
    }
  }
  error.expect_below(1e-13, "orthogonality and reconstruction");
  values.expect_below(1e-13, "singular values");
}

TEST(SignedSvd, DecomposesMatricesOfAnyEntries) {
  WorstError error;
  for (unsigned seed = 0; seed < num_matrices; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    Matrix3 f = random.vectors<3>(3, 1);
    for (int k = 0; k < 3; ++k) f.col(k) *= std::pow(10.0, random.uniform(-6, 6));
    for (const Matrix3& g : {f, Matrix3(f.transpose())}) {
      const SignedSvd svd = signed_svd(g);
      expect_decomposed(g, svd, error, seed);
      EXPECT_EQ(svd.s[2] < 0, g.determinant() < 0);
    }
  }
  error.expect_below(1e-13, "orthogonality and reconstruction");
}

TEST(SignedSvd, SmallValuesKeepTheirDigits) {
  WorstError error;
  for (unsigned seed = 0; seed < num_matrices; ++seed) {
    Random random(seed);
    const Vector3 s(random.uniform(0.5, 2), random.uniform(1e-5, 1e-4), -random.uniform(1e-10, 1e-9));
    const Vector3 actual = signed_singular_values(random.rotation() * s.asDiagonal());
    error.see((actual.cwiseQuotient(s) - Vector3::Ones()).norm(), seed);
  }
  error.expect_below(1e-13, "relative error of each value");
}

TEST(SignedSvd, OfZeroIsTheIdentity) {
  const SignedSvd svd = signed_svd(Matrix3::Zero());
  EXPECT_EQ(svd.u, Matrix3::Identity());
  EXPECT_EQ(svd.v, Matrix3::Identity());
  EXPECT_EQ(svd.s, Vector3::Zero());
}

TEST(SignedSvd, OfWhatIsNotFiniteIsNotFinite) {
  for (const Real bad : {std::numeric_limits<Real>::quiet_NaN(), std::numeric_limits<Real>::infinity()})
    for (int k = 0; k < 9; ++k) {
      Matrix3 f = Random(3).vectors<3>(3, 1);
      f.data()[k] = bad;
      EXPECT_FALSE(signed_singular_values(f).allFinite()) << f;
    }
}

// An energy of both invariants, psi = I²/4 + 2 I + J²/2 - 3 J, and its derivatives.
InvariantDerivatives derivatives(const Matrix3& f) {
  return {.i = f.squaredNorm() / 2 + 2, .ii = 0.5, .j = f.determinant() - 3, .jj = 1};
}

Matrix3 cofactors(const Matrix3& f) {
  Matrix3 c;
  c << f.col(1).cross(f.col(2)), f.col(2).cross(f.col(0)), f.col(0).cross(f.col(1));
  return c;
}

Matrix3 edges(const Points<4>& p) { return p.rightCols<3>().colwise() - p.col(0); }

// dpsi/dp by the chain rule.
Gradient<4> gradient(const Points<4>& p, const Matrix3& m) {
  const Matrix3 f = edges(p) * m;
  const InvariantDerivatives d = derivatives(f);
  Gradient<4> g;
  g.rightCols<3>() = (2 * d.i * f + d.j * cofactors(f)) * m.transpose();
  g.col(0) = -g.rightCols<3>().rowwise().sum();
  return g;
}

TEST(IsotropicHessian, IsTheDerivativeOfTheGradientForEveryMatrix) {
  WorstError error, asymmetry;
  for (unsigned seed = 0; seed < num_matrices; ++seed) {
    Random random(seed);
    const Matrix3 u = random.rotation(), v = random.rotation(), m = random.rotation() + 0.5 * Matrix3::Identity();
    if (std::abs(m.determinant()) < 0.1) continue;
    for (const auto& [name, s] : stretches(random)) {
      const Matrix3 f = u * s.asDiagonal() * v.transpose();
      Points<4> p;
      p << Vector3::Zero(), f * m.inverse();
      p.colwise() += random.vector(1);
      const SignedSvd svd = signed_svd(f);
      const Hessian<4> hessian = isotropic_hessian(svd, PrincipalStiffness::of(derivatives(f), svd.s), m);
      const auto g = [&](const Points<4>& q) { return gradient(q, m); };
      error.see(relative_error(central_difference_hessian<4>(g, p, 1e-5), hessian), seed);
      asymmetry.see((hessian - hessian.transpose()).norm(), seed);
    }
  }
  error.expect_below(1e-7, "relative error");
  asymmetry.expect_below(1e-300, "asymmetry");
}

TEST(PrincipalStiffness, ItsPositivePartIsTheNearest) {
  WorstError error;
  int indefinite = 0;
  for (unsigned seed = 0; seed < num_matrices; ++seed) {
    Random random(seed);
    const Matrix3 r = random.rotation();
    const Real x = random.uniform(0.1, 1), y = random.uniform(-1, 1), z = random.uniform(-1, 1);
    for (const Vector3& eigenvalues :
         {Vector3(x, y, z), Vector3(x, x, -x), Vector3(x, -x, 0), Vector3(-x, 0, 0), Vector3(x, 0, 0), Vector3(x, 1, x),
          Vector3(-x, -x, -1), Vector3(x, -1e-9, 1e-12), Vector3(0, 0, 0)})
      for (const Real unit : {1.0, 1e-6, 1e6, 1e-150, 1e150}) {
        Matrix3 stretch = r * eigenvalues.asDiagonal() * r.transpose();
        stretch = unit / 2 * (stretch + stretch.transpose().eval());
        PrincipalStiffness stiffness{stretch, unit * Vector3(y, -x, x), unit * Vector3(-x, z, 0)};
        stiffness.make_psd();
        error.see((stiffness.stretch / unit - psd_projection<3>(stretch / unit)).norm(), seed);
        EXPECT_EQ(stiffness.twist, unit * Vector3(std::max(y, 0.0), 0, x));
        EXPECT_EQ(stiffness.flip, unit * Vector3(0, std::max(z, 0.0), 0));
        indefinite += eigenvalues.minCoeff() < 0 && eigenvalues.maxCoeff() > 0;
      }
  }
  EXPECT_GT(indefinite, 1000);
  error.expect_below(1e-14, "distance from the projection");
}

TEST(PrincipalStiffness, ThatIsPositiveIsLeftAlone) {
  Matrix3 a;
  a << 2, 1, 0, 1, 2, 0, 0, 0, 5;
  PrincipalStiffness stiffness{a, {1, 2, 3}, {0, 4, 5}};
  stiffness.make_psd();
  EXPECT_EQ(stiffness.stretch, a);
  EXPECT_EQ(stiffness.twist, Vector3(1, 2, 3));
  EXPECT_EQ(stiffness.flip, Vector3(0, 4, 5));
}

}  // namespace
}  // namespace penalty::testing
