#include "penalty/math/isotropic_projection.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "penalty/math/triple.h"

namespace penalty {
namespace {

constexpr Real tiny = 1e-15;  // relative: what counts as orthogonal, and as zero

/// F V and V, by columns.
struct Columns {
  Triple b[3], v[3];
};

// Turns the axes p < q so that columns p and q of F V are orthogonal and the longer one comes first; whether there was
// anything to do. The angle has tan 2t = 2 pq / (pp - qq).
template <int p, int q>
[[gnu::always_inline]] inline bool make_orthogonal(Columns& c) {
  const Real pp = dot(c.b[p], c.b[p]), qq = dot(c.b[q], c.b[q]), pq = dot(c.b[p], c.b[q]);
  if (!(qq > pp) && !(pq * pq > tiny * tiny * pp * qq && qq > tiny * tiny * pp)) return false;
  const Real difference = std::abs(pp - qq), length = std::sqrt(difference * difference + 4 * pq * pq);
  const Real scale = 1 / std::sqrt(2 * length * (length + difference));
  Real cosine = (length + difference) * scale, sine = 2 * pq * scale;
  if (qq > pp) std::swap(cosine, sine);
  const auto turn = [&](Triple& x, Triple& y) {
    const Triple turned = x * cosine + y * sine;
    y = y * cosine - x * sine;
    x = turned;
  };
  turn(c.b[p], c.b[q]);
  turn(c.v[p], c.v[q]);
  return true;
}

/// F V with orthogonal columns, the longest first, and V. F V is in the unit `unit`: 1 unless squares of squares of F
/// would leave the range of a Real, and not a number if F is not finite.
struct OrthogonalColumns : Columns {
  Real unit = 1;

  [[gnu::always_inline]] explicit OrthogonalColumns(const Matrix3& f)
      : Columns{{Triple::column(f, 0), Triple::column(f, 1), Triple::column(f, 2)}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}} {
    const Real squares = dot(b[0], b[0]) + dot(b[1], b[1]) + dot(b[2], b[2]);
    if (!(squares > 1e-100 && squares < 1e100)) [[unlikely]] {
      if (!f.allFinite()) {
        unit = std::numeric_limits<Real>::quiet_NaN();
        return;
      }
      const Real largest = f.cwiseAbs().maxCoeff();
      if (!(largest > std::numeric_limits<Real>::min())) return;
      unit = largest;
      for (int k = 0; k < 3; ++k) b[k] = {f(0, k) / unit, f(1, k) / unit, f(2, k) / unit};
    }
    for (int sweep = 0; sweep < 20; ++sweep) {  // quadratic convergence: four or so
      const bool turned01 = make_orthogonal<0, 1>(*this), turned02 = make_orthogonal<0, 2>(*this);
      if (!make_orthogonal<1, 2>(*this) && !turned01 && !turned02) return;
    }
  }
};

Real length(Triple a) { return std::sqrt(dot(a, a)); }

Triple any_perpendicular(Triple a) {
  const Real x = std::abs(a.x), y = std::abs(a.y), z = std::abs(a.z);
  const Triple axis = x <= y && x <= z ? Triple{1, 0, 0} : y <= z ? Triple{0, 1, 0} : Triple{0, 0, 1};
  const Triple normal = cross(a, axis);
  return normal * (1 / length(normal));
}

// By LDLᵀ without pivoting: it may say no of a singular matrix.
bool is_surely_psd(const Matrix3& a) {
  const Real d0 = a(0, 0);
  if (!(d0 > 0)) return false;
  const Real l1 = a(1, 0) / d0, l2 = a(2, 0) / d0;
  const Real d1 = a(1, 1) - l1 * a(1, 0), rest = a(2, 1) - l1 * a(2, 0);
  return d1 > 0 && a(2, 2) - l2 * a(2, 0) >= rest * rest / d1;
}

}  // namespace

SignedSvd signed_svd(const Matrix3& f) {
  const OrthogonalColumns c(f);
  SignedSvd svd;
  for (int k = 0; k < 3; ++k) c.v[k].store(svd.v, k);
  const Real s0 = length(c.b[0]);
  if (!(s0 > 0)) return {Matrix3::Identity(), Vector3::Constant(s0 * c.unit), Matrix3::Identity()};
  const Triple u0 = c.b[0] * (1 / s0);
  const Triple b1 = c.b[1] - u0 * dot(u0, c.b[1]);
  Real s1 = std::min(length(b1), s0), s2 = 0;
  Triple u1, u2;
  if (s1 <= tiny * s0) {
    s1 = 0;
    u1 = any_perpendicular(u0);
    u2 = cross(u0, u1);
  } else {
    u1 = b1 * (1 / s1);
    u2 = cross(u0, u1);
    s2 = std::clamp(dot(u2, c.b[2]), -s1, s1);
  }
  u0.store(svd.u, 0);
  u1.store(svd.u, 1);
  u2.store(svd.u, 2);
  svd.s << s0 * c.unit, s1 * c.unit, s2 * c.unit;
  return svd;
}

Vector3 signed_singular_values(const Matrix3& f) { return signed_svd(f).s; }

PrincipalStiffness PrincipalStiffness::of(const InvariantDerivatives& psi, const Vector3& s) {
  const Real dj[3] = {s[1] * s[2], s[2] * s[0], s[0] * s[1]};
  PrincipalStiffness stiffness;
  for (int i = 0; i < 3; ++i) {
    const Real j = psi.j * s[i];
    stiffness.twist[i] = 2 * psi.i + j;
    stiffness.flip[i] = 2 * psi.i - j;
    stiffness.stretch(i, i) = 2 * psi.i + 4 * psi.ii * s[i] * s[i] + psi.jj * dj[i] * dj[i];
    const int p = (i + 1) % 3, q = (i + 2) % 3;
    stiffness.stretch(p, q) = stiffness.stretch(q, p) = 4 * psi.ii * s[p] * s[q] + psi.jj * dj[p] * dj[q] + j;
  }
  return stiffness;
}

void PrincipalStiffness::make_psd() {
  twist = twist.cwiseMax(0);
  flip = flip.cwiseMax(0);
  if (is_surely_psd(stretch)) return;
  // The positive part is (A + |A|) / 2, and |A| = sqrt(AᵀA) = V diag(lengths of the columns of A V) Vᵀ; unlike
  // eigenvectors it does not depend on the choice of V where two lengths agree.
  const OrthogonalColumns c(stretch);
  for (int k = 0; k < 3; ++k) {
    const Triple v = c.v[k], w = v * (length(c.b[k]) * c.unit);
    const Real x[3] = {v.x, v.y, v.z}, y[3] = {w.x, w.y, w.z};
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 3; ++i) stretch(i, j) += x[std::max(i, j)] * y[std::min(i, j)];
  }
  stretch *= 0.5;
}

// With x = Vᵀ w_a and y = Vᵀ w_b, w_a row a of M, moving p_a by e along u_i changes Uᵀ F V by e xᵀ in row i. Hence in
// the frame of U the block (a, b) is
//   (i, j): x_i y_j A_ij + x_j y_i b_k                         A the stretch, k the third axis, b = (flip - twist) / 2
//   (i, i): x_i y_i A_ii + sum over j != i of x_j y_j a_k      a = (flip + twist) / 2
// and the rows of blocks sum to zero.
Hessian<4> isotropic_hessian(const SignedSvd& f, const PrincipalStiffness& stiffness, const Matrix3& m) {
  const auto& [stretch, twist, flip] = stiffness;
  const Real a00 = stretch(0, 0), a11 = stretch(1, 1), a22 = stretch(2, 2);
  const Real a01 = stretch(0, 1), a12 = stretch(1, 2), a20 = stretch(2, 0);
  Real even[3], odd[3];
  for (int k = 0; k < 3; ++k) {
    even[k] = (flip[k] + twist[k]) / 2;
    odd[k] = (flip[k] - twist[k]) / 2;
  }
  Triple weights[3];
  for (int a = 0; a < 3; ++a) {
    const Triple w{m(a, 0), m(a, 1), m(a, 2)};
    weights[a] = {dot(Triple::column(f.v, 0), w), dot(Triple::column(f.v, 1), w), dot(Triple::column(f.v, 2), w)};
  }
  const Triple u0 = Triple::column(f.u, 0), u1 = Triple::column(f.u, 1), u2 = Triple::column(f.u, 2);
  const Triple rows[3] = {{u0.x, u1.x, u2.x}, {u0.y, u1.y, u2.y}, {u0.z, u1.z, u2.z}};
  Hessian<4> h;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b <= a; ++b) {
      const Triple x = weights[a], y = weights[b];
      const Real xx = x.x * y.x, xy = x.x * y.y, xz = x.x * y.z;
      const Real yx = x.y * y.x, yy = x.y * y.y, yz = x.y * y.z;
      const Real zx = x.z * y.x, zy = x.z * y.y, zz = x.z * y.z;
      // Columns of the block, in the frame of U.
      const Triple c0{xx * a00 + yy * even[2] + zz * even[1], yx * a01 + xy * odd[2], zx * a20 + xz * odd[1]};
      const Triple c1{xy * a01 + yx * odd[2], yy * a11 + xx * even[2] + zz * even[0], zy * a12 + yz * odd[0]};
      const Triple c2{xz * a20 + zx * odd[1], yz * a12 + zy * odd[0], zz * a22 + xx * even[1] + yy * even[0]};
      const Triple d0 = u0 * c0.x + u1 * c0.y + u2 * c0.z;
      const Triple d1 = u0 * c1.x + u1 * c1.y + u2 * c1.z;
      const Triple d2 = u0 * c2.x + u1 * c2.y + u2 * c2.z;
      for (int j = 0; j < 3; ++j) {
        const Triple column = d0 * rows[j].x + d1 * rows[j].y + d2 * rows[j].z;
        const int row = 3 + 3 * a, col = 3 + 3 * b + j;
        h(row, col) = h(col, row) = column.x;
        h(row + 1, col) = h(col, row + 1) = column.y;
        h(row + 2, col) = h(col, row + 2) = column.z;
      }
    }
  for (int col = 3; col < 12; ++col)
    for (int i = 0; i < 3; ++i) h(i, col) = h(col, i) = -(h(3 + i, col) + h(6 + i, col) + h(9 + i, col));
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i <= j; ++i) h(i, j) = h(j, i) = -(h(i, 3 + j) + h(i, 6 + j) + h(i, 9 + j));
  return h;
}

}  // namespace penalty
