// What the bodies of a study are made of.
#pragma once
#include <span>
#include <string_view>

#include "penalty/fields/potential_field.h"
#include "penalty/mesh/tet_mesh.h"

namespace penalty::study {

struct StudyMaterial {
  std::string_view name, description;
  PotentialField (*make)(const TetMesh& mesh);
};

/// The first one is what an application gets by default.
std::span<const StudyMaterial> study_materials();

/// Throws std::invalid_argument that names the choices.
const StudyMaterial& find_material(std::string_view name);

}  // namespace penalty::study
