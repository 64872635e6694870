// Figures of the potentials themselves, as in the paper: equipotential surfaces of one particle with the forces that
// stand on them, and the forces of a volume. Every energy and force comes from a PotentialField.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "render/arrow.h"
#include "scenes/isosurface.h"
#include "scenes/scene_setup.h"

namespace penalty::demo {
namespace potential_field {

constexpr Real degree = std::numbers::pi / 180;
const render::Color dark{0.16f, 0.18f, 0.22f}, grey{0.55f, 0.57f, 0.60f}, force_color{0.86f, 0.22f, 0.16f};

/// A regular tetrahedron of side 1 m: a base about the origin in the plane y = 0 and an apex above it.
Eigen::Matrix3Xd regular_tetrahedron() {
  Eigen::Matrix3Xd p(3, 4);
  for (int i = 0; i < 3; ++i) {
    const Real turn = (90 - 120 * i) * degree;
    p.col(i) << std::cos(turn) / std::sqrt(3.0), 0, std::sin(turn) / std::sqrt(3.0);
  }
  p.col(3) << 0, std::sqrt(2.0 / 3), 0;
  return p;
}
constexpr int apex = 3;
const std::vector<Tetrahedron> one_tetrahedron{{0, 2, 1, 3}};

/// A field seen from its apex, all other particles held.
class FromApex {
 public:
  FromApex(const PotentialField& field) : field_(field), x_(field.rest_positions()) {}

  Real energy(const Vector3& p) {
    x_.col(apex).head<3>() = p;
    return field_.energy(x_);
  }
  Vector3 force(const Vector3& p) {
    x_.col(apex).head<3>() = p;
    PackedVectors forces = PackedVectors::Zero(4, x_.cols());
    field_.add_forces(x_, forces);
    return forces.col(apex).head<3>();
  }

 private:
  const PotentialField& field_;
  PackedVectors x_;
};

Isosurface moved(Isosurface surface, const Vector3& shift) {
  surface.vertices.colwise() += shift;
  return surface;
}

/// Vertices of the surface where `keep` < -border, no two closer than `spacing`.
std::vector<int> spread(const Isosurface& surface, const SpaceFunction& keep, Real border, Real spacing) {
  std::vector<int> chosen;
  for (int v = 0; v < surface.vertices.cols(); ++v) {
    const Vector3 p = surface.vertices.col(v);
    if (keep(p) > -border) continue;
    const bool free = std::none_of(chosen.begin(), chosen.end(),
                                   [&](int other) { return (surface.vertices.col(other) - p).norm() < spacing; });
    if (free) chosen.push_back(v);
  }
  return chosen;
}

constexpr Real azimuth = 30;  // of the view, and of the wedge that is cut out towards it [degrees]
const std::vector<Real> levels{0.02, 0.08, 0.18, 0.32};  // [J]

/// The largest angle between the drawn forces and the normals of the drawn surface [rad], and how far the forces are
/// from the central differences of the energy, over their own size.
struct ForceErrors {
  Real angle = 0, difference = 0;
};

/// Nested surfaces of the apex's energy, the forces on the outermost, and the springs, about `place`.
ForceErrors add_shells(Figure& figure, const PotentialField& field, const Vector3& place, int cells) {
  FromApex particle(field);
  const SpaceFunction energy = [&](const Vector3& p) { return particle.energy(p); };
  const auto across = [](Real angle) { return Vector3(std::sin(angle * degree), 0, std::cos(angle * degree)); };
  const SpaceFunction wedge = [a = across(azimuth - 50), b = across(azimuth + 50)](const Vector3& p) {
    return std::min(a.dot(p), b.dot(p));
  };
  ForceErrors errors;
  for (const Real level : levels) {
    const Isosurface whole = isosurface(energy, level, {-1.6, -1.9, -1.6}, {1.6, 1.9, 1.6}, cells);
    const Isosurface cut = moved(clipped(whole, wedge), place);
    render::SoftSurface drawn;
    drawn.vertices = cut.vertices;
    drawn.triangles = cut.triangles;
    drawn.values = Eigen::VectorXd::Constant(cut.vertices.cols(), level);
    drawn.wire = false;
    figure.frame.surfaces.push_back(std::move(drawn));
    if (level != levels.back()) continue;
    const Eigen::Matrix3Xd outward = normals(whole);
    for (const int v : spread(whole, wedge, 0.06, 0.28)) {
      const Vector3 p = whole.vertices.col(v), force = particle.force(p);
      Vector3 downhill;
      for (int axis = 0; axis < 3; ++axis) {
        const Vector3 step = 1e-5 * Vector3::Unit(axis);
        downhill[axis] = (energy(p - step) - energy(p + step)) / 2e-5;
      }
      errors.angle = std::max(errors.angle, std::atan2(force.cross(outward.col(v)).norm(), -force.dot(outward.col(v))));
      errors.difference = std::max(errors.difference, (force - downhill).norm() / force.norm());
      render::append_arrow(figure.frame.bodies, place + p - 0.22 * force, place + p, 0.012, force_color);
    }
  }
  const PackedVectors& rest = field.rest_positions();
  for (int i = 0; i < apex; ++i) {
    figure.frame.markers.push_back({.position = place + rest.col(i).head<3>(), .color = dark, .radius = 0.05});
    render::append_bar(figure.frame.bodies, place + rest.col(i).head<3>(), place + rest.col(apex).head<3>(), 0.012,
                       grey);
  }
  figure.frame.markers.push_back({.position = place + rest.col(apex).head<3>(), .radius = 0.05});
  return errors;
}

Figure shells(int cells) {
  Figure figure{.name = "potential_field"};
  const Eigen::Matrix3Xd rest = regular_tetrahedron();
  const std::vector<Edge> springs{{0, apex}, {1, apex}, {2, apex}};
  PotentialField lengths(rest), both(rest);
  lengths.add<Length>(springs, 1.0);
  both.add<Length>(springs, 1.0);
  both.add<TetrahedronVolume>(one_tetrahedron, 1.0);
  figure.frame.colors = {.map = render::ColorMap::viridis, .low = 0, .high = 0.4, .square_root = true};
  const Vector3 mirrored = Vector3(1, -1, 1).cwiseProduct(rest.col(apex)) + Vector3(-1.45, 0, 0);
  figure.frame.markers.push_back({.position = mirrored, .radius = 0.05});  // the springs are as content with it
  figure.frame.ground = -1.9;
  const ForceErrors left = add_shells(figure, lengths, {-1.45, 0, 0}, cells);
  const ForceErrors right = add_shells(figure, both, {1.45, 0, 0}, cells);
  figure.overlay.title = "Potential of a particle that is joined to three fixed ones";
  figure.overlay.subtitle = {"left: springs only, two rest places", "right: with the volume, one",
                             "arrows: forces, normal to the surfaces"};
  figure.overlay.color_bar = render::ColorBar{"energy [J]", 1};
  figure.view = {.azimuth = azimuth, .elevation = 16, .left = -0.86};
  figure.facts = {{"largest_angle_to_normal_degrees", std::max(left.angle, right.angle) / degree},
                  {"largest_force_error", std::max(left.difference, right.difference)}};
  return figure;
}

/// Forces of the volume penalty on a tetrahedron that is compressed, at rest, and inflated.
Figure volume_forces() {
  Figure figure{.name = "volume_force"};
  const Eigen::Matrix3Xd rest = regular_tetrahedron();
  PotentialField field(rest);
  constexpr Real stiffness = 1;  // [J]
  field.add<TetrahedronVolume>(one_tetrahedron, stiffness);
  const Vector3 middle = rest.rowwise().mean();
  const Real rest_volume = std::sqrt(2.0) / 12;
  Real worst = 0, net = 0;
  const Real volumes[3] = {0.4, 1, 1.5};  // over that at rest
  for (int k = 0; k < 3; ++k) {
    const Vector3 place(1.55 * (k - 1), 0, 0);
    const Eigen::Matrix3Xd x = (std::cbrt(volumes[k]) * (rest.colwise() - middle)).colwise() + middle;
    PackedVectors forces = PackedVectors::Zero(4, 4);
    field.add_forces(pack(x), forces);
    net = std::max(net, forces.rowwise().sum().norm());

    render::SoftSurface drawn;
    drawn.vertices = x.colwise() + place;
    drawn.triangles = boundary_faces(one_tetrahedron);
    drawn.values = Eigen::VectorXd::Constant(4, volumes[k] - 1);
    figure.frame.surfaces.push_back(std::move(drawn));
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < i; ++j)
        render::append_bar(figure.frame.bodies, place + rest.col(i), place + rest.col(j), 0.009, grey);
      const Vector3 force = forces.col(i).head<3>(), tip = place + x.col(i);
      figure.frame.markers.push_back({.position = tip, .color = dark, .radius = 0.03});
      const Vector3 away = (force.dot(x.col(i) - middle) > 0 ? 1 : -1) * 0.04 * force.normalized();
      if (volumes[k] < 1)
        render::append_arrow(figure.frame.bodies, tip + away, tip + away + 0.75 * force, 0.02, force_color);
      if (volumes[k] > 1)
        render::append_arrow(figure.frame.bodies, tip + away - 0.75 * force, tip + away, 0.02, force_color);

      // Closed form: |dV/dp_i| is a third of the opposite face, so |F_i| = K |C| A_i / (3 V0).
      const Real side = std::cbrt(volumes[k]), face = std::sqrt(3.0) / 4 * side * side;
      const Vector3 expected =
          stiffness * (1 - volumes[k]) * face / (3 * rest_volume) * (x.col(i) - middle).normalized();
      worst = std::max(worst, (force - expected).norm() / (stiffness * face / (3 * rest_volume)));
    }
  }
  figure.frame.colors = {.map = render::ColorMap::diverging, .low = -0.6, .high = 0.6};
  figure.frame.ground = -0.4;
  figure.overlay.title = "Forces of the volume penalty";
  figure.overlay.subtitle = {"compressed to 40 %", "at rest", "inflated to 150 %", "bars: the rest shape"};
  figure.overlay.color_bar = render::ColorBar{"C = V/V0 - 1", 1};
  figure.view = {.azimuth = 16, .elevation = 16, .left = -0.84};
  figure.facts = {{"largest_volume_force_error", worst}, {"largest_net_force", net}};
  return figure;
}

std::vector<Figure> setup(const SceneOptions& options) {
  refuse_mesh(options, "potential_field");
  std::vector<Figure> figures;
  figures.push_back(shells(cells_in(options, 72, 8, 200)));
  figures.push_back(volume_forces());
  return figures;
}

}  // namespace potential_field

const SceneEntry potential_field_scene{"potential_field",
                                       "a figure: equipotential surfaces of one particle, and the forces of a volume",
                                       6,
                                       nullptr,
                                       nullptr,
                                       potential_field::setup};

}  // namespace penalty::demo
