// Energies of a 3 x 3 matrix that are the same in every direction: their stiffness, made positive semidefinite along
// the principal axes instead of by the eigenvectors of a 12 x 12 matrix.
#pragma once
#include "penalty/math/types.h"

namespace penalty {

/// F = U diag(s) Vᵀ with rotations U and V, hence s_0 >= s_1 >= |s_2| and s_2 of the sign of det F: the principal
/// stretches, if F is a deformation gradient. U and V are rotations also where F is singular and the choice is free; of
/// zero both are the identity.
struct SignedSvd {
  Matrix3 u;
  Vector3 s;
  Matrix3 v;
};

/// One-sided Jacobi (Hestenes 1958): rotates the columns of F until they are orthogonal, so that small singular values
/// are not lost in the square of a large one. Next to 1e-15 |F| and below they count as zero. Of an F that is not
/// finite, s is not finite either.
SignedSvd signed_svd(const Matrix3& f);

/// The s of `signed_svd`.
Vector3 signed_singular_values(const Matrix3& f);

/// First and second derivatives of psi(I, J), I = |F|², J = det F, where I and J do not mix: d²psi/dIdJ = 0.
struct InvariantDerivatives {
  Real i, ii, j, jj;
};

/// d²psi/dF² along the principal axes (Smith, de Goes and Kim 2019, "Analytic Eigensystems for Isotropic Distortion
/// Energies"), for psi a function of the principal stretches: with T_ij = u_i v_jᵀ it couples the three T_ii by
/// `stretch`, d²psi/ds_i ds_j, and has, for each axis k and the two others i and j, the eigenmatrices (T_ij - T_ji)/√2
/// with eigenvalue twist_k = (psi_i + psi_j) / (s_i + s_j) and (T_ij + T_ji)/√2 with flip_k = (psi_i - psi_j) / (s_i -
/// s_j), where psi_i = dpsi/ds_i.
struct PrincipalStiffness {
  Matrix3 stretch;
  Vector3 twist, flip;

  /// The quotients are divided out on paper: J has dJ/ds_i = s_j s_k, so that no stretches are too near to one another.
  static PrincipalStiffness of(const InvariantDerivatives& psi, const Vector3& s);

  /// The nearest positive semidefinite one: no eigenvalue is less than zero.
  void make_psd();
};

/// d²psi/dp² of a psi(F) of four points, F = [p1 - p0, p2 - p0, p3 - p0] M, from the decomposition `f` of F and
/// d²psi/dF². It is positive semidefinite if d²psi/dF² is.
Hessian<4> isotropic_hessian(const SignedSvd& f, const PrincipalStiffness& stiffness, const Matrix3& m);

}  // namespace penalty
