#include "penalty/contact/closest_points.h"

#include <algorithm>

namespace penalty {
namespace {

constexpr Real parallel = 1e-8;  // squared sine between edges below which they count as parallel

Real share(Real part, Real whole) { return whole > 0 ? part / whole : 0; }

}  // namespace

ClosestPoints closest_points_of_triangle(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const Real d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
  const Real vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  Real v = 0, w = 0;  // the point is a + v ab + w ac
  bool interior = false;
  if (d1 <= 0 && d2 <= 0) {
  } else if (d3 >= 0 && d4 <= d3) {
    v = 1;
  } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    v = share(d1, d1 - d3);
  } else if (d6 >= 0 && d5 <= d6) {
    w = 1;
  } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    w = share(d2, d2 - d6);
  } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    w = share(d4 - d3, (d4 - d3) + (d5 - d6));
    v = 1 - w;
  } else {
    v = vb / (va + vb + vc);
    w = vc / (va + vb + vc);
    interior = true;
  }
  return {.weights = {1, v + w - 1, -v, -w}, .difference = ap - v * ab - w * ac, .is_interior = interior};
}

ClosestPoints closest_points_of_edges(const Vector3& p1, const Vector3& q1, const Vector3& p2, const Vector3& q2) {
  const Vector3 d1 = q1 - p1, d2 = q2 - p2, r = p1 - p2;
  const Real a = d1.squaredNorm(), e = d2.squaredNorm(), f = d2.dot(r), c = d1.dot(r), b = d1.dot(d2);
  const Real denominator = a * e - b * b;
  bool interior = denominator > parallel * a * e;
  Real s = interior ? (b * f - c * e) / denominator : 0.5;
  if (s <= 0 || s >= 1) {
    s = std::clamp<Real>(s, 0, 1);
    interior = false;
  }
  Real t = share(b * s + f, e);
  if (t <= 0 || t >= 1) {
    t = std::clamp<Real>(t, 0, 1);
    s = std::clamp<Real>(share(b * t - c, a), 0, 1);
    interior = false;
  }
  return {.weights = {1 - s, s, t - 1, -t}, .difference = r + s * d1 - t * d2, .is_interior = interior};
}

}  // namespace penalty
