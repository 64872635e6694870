// The soft body of a scene: built, read, or embedded in a lattice.
#pragma once
#include <filesystem>
#include <optional>

#include "penalty/mesh/embed.h"
#include "penalty/solvers/contact.h"
#include "scenes/scene_options.h"

namespace penalty::demo {

struct BodyMesh {
  TetMesh mesh;                            // what is simulated
  std::optional<EmbeddedSurface> surface;  // what is drawn and touches, where that is not the boundary of the mesh

  /// The drawn surface where `positions`, 3 x vertices of the mesh, take it [m].
  Eigen::Matrix3Xd drawn(const Eigen::Matrix3Xd& positions) const;
  std::vector<Triangle> drawn_triangles() const;

  /// Points of the surface that stand for it in contacts; empty without a surface: every vertex of the mesh then does.
  std::vector<ContactPoint> contact_points() const;
};

/// The Stanford bunny as Debian's package glmark2-data brings it.
std::filesystem::path bunny_path();

/// The mesh of `options.mesh`, or of `by_default`, about the origin. Throws MeshError for a file that is no usable mesh
/// and std::invalid_argument for an unknown name or an impossible number of cells; both say it in one line.
BodyMesh load_body(const SceneOptions& options, const std::string& by_default);

}  // namespace penalty::demo
