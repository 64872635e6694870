// From a material to a thin sheet: what stretching and bending it takes.
#include <numbers>

#include "fields/meshes.h"
#include "penalty/mesh/surface_builders.h"

namespace penalty::testing {
namespace {

constexpr Real thickness = 2e-3;

struct Mesh {
  Eigen::Matrix3Xd vertices;
  std::vector<Triangle> triangles;
};

// Equal equilateral triangles with edges of 1, in the plane z = 0.
Mesh equilateral(int columns, int rows) {
  Mesh mesh{Eigen::Matrix3Xd::Zero(3, (columns + 1) * (rows + 1)), {}};
  for (int row = 0; row <= rows; ++row)
    for (int column = 0; column <= columns; ++column)
      mesh.vertices.col(row * (columns + 1) + column) << column + 0.5 * row, row * std::sqrt(0.75), 0;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const int a = row * (columns + 1) + column, b = a + 1, c = a + columns + 1, d = c + 1;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({b, d, c});
    }
  return mesh;
}

Real area_of(const Mesh& mesh) {
  Real sum = 0;
  for (const Real area : areas_of(mesh.vertices, mesh.triangles)) sum += area;
  return sum;
}

PotentialField sheet_of(const Mesh& mesh, const Material& material, Real bending = 1) {
  return make_sheet_field(mesh.vertices, mesh.triangles, material, {.thickness = thickness, .bending = bending});
}

TEST(SheetField, StretchesAsAPlateUnderPlaneStress) {
  const Mesh mesh = equilateral(3, 4);
  constexpr Real strain = 1e-6, young = 3e5;
  for (const Real nu : {1.0 / 3, 0.4, 0.49})
    for (const Eigen::Vector3d& e : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(1, 1, 0),
                                     Eigen::Vector3d(1, -1, 0), Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(3, 1, -2)}) {
      Matrix3 map = Matrix3::Identity();
      map(0, 0) += strain * e[0];
      map(1, 1) += strain * e[1];
      map(0, 1) += strain * e[2];  // the engineering shear
      const Real expected = area_of(mesh) * thickness * young / (2 * (1 - nu * nu)) * strain * strain *
                            (e[0] * e[0] + e[1] * e[1] + 2 * nu * e[0] * e[1] + (1 - nu) / 2 * e[2] * e[2]);
      const Real energy =
          sheet_of(mesh, {.young = young, .poisson = nu}).energy(pack(Eigen::Matrix3Xd(map * mesh.vertices)));
      EXPECT_NEAR(energy, expected, 2e-5 * expected) << "nu " << nu << ", strain " << e.transpose();
    }
}

// Bent about the y axis to a radius, every point at its distance along the arc.
Real energy_on_a_cylinder(const Mesh& mesh, Real radius, const Material& material) {
  Eigen::Matrix3Xd x = mesh.vertices;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const Real angle = mesh.vertices(0, i) / radius;
    x.col(i) << radius * std::sin(angle), mesh.vertices(1, i), radius * (1 - std::cos(angle));
  }
  const PotentialField field = sheet_of(mesh, material);
  return field.find<BendingAngle>()->energy(pack(x));
}

TEST(SheetField, BendsAsAPlate) {
  const Material material{.young = 1e6, .poisson = 0.4};
  const Real curvature = 1e-3;
  const Real rigidity = material.young * std::pow(thickness, 3) / (12 * (1 - 0.4 * 0.4));
  // Edges at the rim have no hinge: what that takes goes with the rim, and is none in the difference of two sizes.
  const auto energy_and_area = [&](int cells) {
    const Mesh mesh = equilateral(cells, cells);
    return std::array{energy_on_a_cylinder(mesh, 1 / curvature, material), area_of(mesh)};
  };
  const auto [e1, a1] = energy_and_area(10);
  const auto [e2, a2] = energy_and_area(20);
  const auto [e4, a4] = energy_and_area(40);
  const Real energy = e4 - 3 * e2 + 2 * e1, area = a4 - 3 * a2 + 2 * a1;
  EXPECT_NEAR(energy, rigidity / 2 * curvature * curvature * area, 1e-3 * energy);
}

TEST(SheetField, IsTheSameHoweverItsTrianglesAreWound) {
  Mesh mesh = equilateral(3, 3);
  const Material material{.young = 1e5, .poisson = 0.4};
  Random random(1);
  const PackedVectors bent = pack(mesh.vertices) + random_packed(mesh.vertices.cols(), 0.1, random);
  const Real energy = sheet_of(mesh, material).energy(bent);
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  EXPECT_NEAR(sheet_of(mesh, material).energy(bent), energy, 1e-12 * energy);
}

TEST(SheetField, HasAHingeForEachTwoTrianglesOfABranchingEdge) {
  const Mesh book{(Eigen::Matrix3Xd(3, 5) << 0, 0, 1, -1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1).finished(),
                  {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}}};
  const PotentialField field = sheet_of(book, {});
  EXPECT_EQ(field.find<BendingAngle>()->num_elements(), 3U);
  EXPECT_EQ(field.energy(pack(book.vertices)), 0);
}

TEST(SheetField, WithoutBendingHasNoHinges) {
  EXPECT_EQ(sheet_of(equilateral(2, 2), {}, 0).find<BendingAngle>(), nullptr);
}

TEST(SheetField, DampsAsItsMaterialSays) {
  const Mesh mesh = equilateral(2, 2);
  Random random(2);
  const PackedVectors x = pack(mesh.vertices) + random_packed(mesh.vertices.cols(), 0.1, random),
                      v = random_packed(mesh.vertices.cols(), 1, random);
  const PackedVectors expected = damping_forces(sheet_of(mesh, {.poisson = 0.4}), x, v, 0.3);
  ASSERT_GT(expected.norm(), 0);
  EXPECT_LT(relative_error(damping_forces(sheet_of(mesh, {.poisson = 0.4, .damping = 0.3}), x, v, 0), expected), 1e-14);
}

std::string refusal(const Material& material, const Sheet& sheet) {
  const Mesh mesh = equilateral(1, 1);
  try {
    make_sheet_field(mesh.vertices, mesh.triangles, material, sheet);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(SheetField, NamesWhatIsOutOfRange) {
  EXPECT_EQ(refusal({.poisson = 0.25}, {}), "material: Poisson's ratio is 0.25, must be in [0.333333, 0.5) for sheets");
  EXPECT_EQ(refusal({}, {.thickness = 0}), "sheet: thickness is 0, must be positive and finite [m]");
  EXPECT_EQ(refusal({}, {.bending = -1}), "sheet: bending is -1, must be zero or positive, and finite");
}

}  // namespace
}  // namespace penalty::testing
