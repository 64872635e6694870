#include "scenes/shell.h"

#include <stdexcept>
#include <string>

namespace penalty::demo {

PotentialField shell_field(const TriangleSurface& surface, const Sheet& sheet) {
  const Eigen::Matrix3Xd& x = surface.vertices;
  PotentialField field(x);
  const std::vector<Edge> edges = edges_of(surface.triangles);
  std::vector<Real> stiffnesses = edge_area_shares(edges, surface.triangles, areas_of(x, surface.triangles));
  for (Real& k : stiffnesses) k *= 3 * sheet.tension_stiffness();
  field.add<Length>(edges, stiffnesses);

  const std::vector<Hinge> hinges = hinges_of(surface.triangles);
  stiffnesses.clear();
  for (const auto& [a, b, left, right] : hinges) {
    const Vector3 edge = x.col(b) - x.col(a);
    const Real twice_areas = edge.cross(x.col(left) - x.col(a)).norm() + edge.cross(x.col(right) - x.col(a)).norm();
    stiffnesses.push_back(2 * sheet.flexural_rigidity() * edge.squaredNorm() / twice_areas);
  }
  if (sheet.bending > 0) field.add<BendingAngle>(hinges, stiffnesses);
  return field;
}

SceneCloth cloth_of(std::string_view scene, const SceneOptions& options, const BodyMesh& body, Sheet sheet) {
  if (options.poisson)
    throw std::invalid_argument("--poisson does not apply to " + std::string(scene) + ": springs in a plane have 1/3");
  if (options.young) sheet.young = *options.young;
  if (!options.stiffness)
    return {shell_field(body.shell(), sheet), sheet.density * sheet.thickness * area(body.shell())};
  PotentialField springs(body.vertices());
  springs.add<Length>(body.edges(), *options.stiffness);
  return {std::move(springs), 1};
}

}  // namespace penalty::demo
