#include "fields/meshes.h"

#include "math/eigenvalues.h"

namespace penalty::testing {

TetMesh noisy_box(const std::array<int, 3>& cells, Real cell_size, Real noise, Random& random) {
  TetMesh mesh = make_box(cell_size * Vector3(cells[0], cells[1], cells[2]), cells);
  mesh.vertices += random.vectors<Eigen::Dynamic>(mesh.vertices.cols(), noise * cell_size);
  return mesh;
}

PackedVectors deformed(const PackedVectors& rest, Real noise, Random& random) {
  Matrix3 stretch = Matrix3::Identity();
  for (Real& entry : stretch.reshaped()) entry += random.uniform(-0.3, 0.3);
  Eigen::Matrix3Xd x = random.rotation() * stretch * rest.topRows<3>();
  x += random.vectors<Eigen::Dynamic>(x.cols(), noise);
  x.colwise() += random.vector(1);
  return pack(x);
}

PackedVectors random_packed(Eigen::Index particles, Real size, Random& random) {
  return pack(random.vectors<Eigen::Dynamic>(particles, size));
}

std::vector<Real> random_inverse_masses(Eigen::Index particles, Random& random) {
  std::vector<Real> inverse_masses(particles);
  for (Real& w : inverse_masses) w = random.uniform(0.5, 4);
  return inverse_masses;
}

Real true_largest_eigenvalue(const PotentialField& field, const PackedVectors& x,
                             const std::vector<Real>& inverse_masses) {
  Eigen::VectorXd scale(3 * x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) scale.segment<3>(3 * i).setConstant(std::sqrt(inverse_masses[i]));
  const Eigen::MatrixXd k = assembled(field, x, StiffnessModel::gauss_newton).to_dense();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * k * scale.asDiagonal();
  return symmetric_eigenvalues(scaled).maxCoeff();
}

}  // namespace penalty::testing
