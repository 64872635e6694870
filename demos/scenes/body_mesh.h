// The soft body of a scene: built, read, or embedded in a lattice; solid, or a shell of triangles.
#pragma once
#include <filesystem>
#include <optional>
#include <variant>

#include "penalty/contact/weighted_point.h"
#include "penalty/mesh/embed.h"
#include "scenes/scene_options.h"

namespace penalty::demo {

struct BodyMesh {
  std::variant<TetMesh, TriangleSurface> mesh;  // what is simulated
  std::optional<EmbeddedSurface> surface = {};  // what is drawn and touches, where that is not the boundary of the mesh

  /// What was amiss with the file, and what became of it; one line, empty if nothing was.
  std::string repairs() const;

  bool is_shell() const { return std::holds_alternative<TriangleSurface>(mesh); }
  const TetMesh& solid() const;  // throws std::invalid_argument, in one line, for a shell
  const TriangleSurface& shell() const { return std::get<TriangleSurface>(mesh); }

  // Whichever of the two it is.
  const Eigen::Matrix3Xd& vertices() const;         // at rest [m]
  std::span<const Tetrahedron> tetrahedra() const;  // none of a shell
  std::vector<Edge> edges() const;
  std::string source() const;  // of what is drawn

  /// The part of the rest volume of a solid [m³], of the rest area of a shell [m²], that each vertex stands for.
  Eigen::VectorXd vertex_shares() const;

  /// The drawn surface where `positions`, 3 x vertices of the mesh, take it [m].
  Eigen::Matrix3Xd drawn(const Eigen::Matrix3Xd& positions) const;
  std::vector<Triangle> drawn_triangles() const;

  /// Points of the surface that stand for it in contacts; empty without a surface: every vertex of the mesh then does.
  std::vector<WeightedPoint> contact_points() const;
};

/// The Stanford bunny as Debian's package glmark2-data brings it.
std::filesystem::path bunny_path();

/// The mesh of `options.mesh`, or of `by_default`, about the origin; of an open sheet a shell. Throws MeshError for a file that is no usable mesh
/// and std::invalid_argument for an unknown name or an impossible number of cells; both say it in one line.
BodyMesh load_body(const SceneOptions& options, const std::string& by_default);

/// options.cells, or `by_default`; throws std::invalid_argument unless it is `least` to `most`.
int cells_in(const SceneOptions& options, int by_default, int least, int most);

/// For scenes that make their own mesh: throws std::invalid_argument if the user names one.
void refuse_mesh(const SceneOptions& options, std::string_view scene);

/// For scenes whose elements are what they show: throws if the user names a model of elasticity.
void refuse_model(const SceneOptions& options, std::string_view scene);

}  // namespace penalty::demo
