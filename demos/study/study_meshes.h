// The bodies of a study by name: built once, shared by all cases.
#pragma once
#include <map>
#include <optional>
#include <string>

#include "scenes/body_mesh.h"

namespace penalty::study {

/// Names: "boxN", N x N x N cells of five tetrahedra; "kuhnN" of six; "beamN", make_beam(N). The boxes are 2 m wide.
/// Not for several threads until everything wanted was loaded.
class StudyMeshes {
 public:
  StudyMeshes() = default;

  /// Adds a mesh of the user, see demo::load_body, and returns its name: that of the file, and a hash of what is in it.
  /// Throws like load_body, and std::invalid_argument for a mesh that has no tetrahedra.
  std::string add_file(const std::string& file);

  /// Builds the mesh if it is not there yet. Throws std::invalid_argument for an unknown name.
  void load(const std::string& name);

  /// Throws std::out_of_range for a mesh that was not loaded.
  const demo::BodyMesh& at(const std::string& name) const { return meshes_.at(name); }

 private:
  std::map<std::string, demo::BodyMesh> meshes_;
};

}  // namespace penalty::study
