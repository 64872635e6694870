// Shapes of points, gradients and Hessians of a constraint, and the packed arrays that the solvers step over.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace penalty {

using Real = double;  // the mathematics is double; btScalar stays in bullet/
using Vector3 = Eigen::Matrix<Real, 3, 1>;
using Matrix3 = Eigen::Matrix<Real, 3, 3>;

inline constexpr int dynamic = Eigen::Dynamic;  // a number of points that is known at run time only

template <int N>
using Points = Eigen::Matrix<Real, 3, N>;  // column i = p_i [m]
template <int N>
using Gradient = Eigen::Matrix<Real, 3, N>;  // column i = dC/dp_i
template <int N>
inline constexpr int num_coordinates = N == dynamic ? dynamic : 3 * N;
template <int N>
using Hessian = Eigen::Matrix<Real, num_coordinates<N>, num_coordinates<N>>;  // block (i, j) = d²C / dp_i dp_j

/// One vector a particle, padded to four reals (the last is zero) so that a particle is one aligned load; column i
/// belongs to particle i.
using PackedVectors = Eigen::Matrix<Real, 4, Eigen::Dynamic>;
using Positions = Eigen::Ref<const PackedVectors>;  // [m]
using Vectors = Eigen::Ref<const PackedVectors>;    // velocities [m/s], displacements [m]
using Forces = Eigen::Ref<PackedVectors>;           // [N]

/// `vectors` is 3 x P.
inline PackedVectors pack(const Eigen::Matrix<Real, 3, Eigen::Dynamic>& vectors) {
  PackedVectors packed = PackedVectors::Zero(4, vectors.cols());
  packed.topRows<3>() = vectors;
  return packed;
}

/// The cross-product matrix: cross_matrix(a) * b = a x b.
inline Matrix3 cross_matrix(const Vector3& a) {
  Matrix3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

namespace detail {

/// Eigen allocates differently under other vector or sanitizer flags, and what one side allocates the other may free: a
/// program whose flags disagree with the library's fails to link, with this name, instead of crashing.
template <int alignment, bool aligned_malloc>
struct EigenFlags {
  static const char same_as_in_the_library;
};
using OwnEigenFlags = EigenFlags<EIGEN_MAX_ALIGN_BYTES, EIGEN_MALLOC_ALREADY_ALIGNED != 0>;
template <>
const char OwnEigenFlags::same_as_in_the_library;  // defined in the library, for its flags alone
[[gnu::used]] inline const char* const eigen_flags = &OwnEigenFlags::same_as_in_the_library;

}  // namespace detail

}  // namespace penalty
