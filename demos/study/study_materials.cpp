#include "study/study_materials.h"

#include <array>
#include <stdexcept>

#include "penalty/fields/elastic_field.h"

namespace penalty::study {
namespace {

constexpr Real young = 1e5;            // [Pa]
constexpr Real spring_poisson = 0.25;  // of springs alone
constexpr Real volume_share = 0.75;    // K of a volume over mu V_t, on top of springs

PotentialField recovering(const TetMesh& mesh, Real poisson, ElasticModel model = ElasticModel::neo_hookean) {
  return make_recovering_field(mesh.vertices, mesh.tetrahedra, {.young = young, .poisson = poisson}, model);
}

PotentialField elastic(const TetMesh& mesh, Real poisson, ElasticModel model) {
  return make_elastic_field(mesh.vertices, mesh.tetrahedra, {.young = young, .poisson = poisson}, model);
}

/// The seed's own potentials, one of them after the other: lengths, and volumes that add to what lengths resist.
PotentialField springs_and_volumes(const TetMesh& mesh) {
  PotentialField field = elastic(mesh, spring_poisson, ElasticModel::springs_volumes);
  std::vector<Real> stiffnesses = signed_volumes(mesh.vertices, mesh.tetrahedra);
  const Real mu = Material{.young = young, .poisson = spring_poisson}.lame_mu();
  for (Real& value : stiffnesses) value *= volume_share * mu;
  field.add<TetrahedronVolume>(mesh.tetrahedra, stiffnesses);
  return field;
}

constexpr std::array<StudyMaterial, 8> materials{
    {{"recovering", "two phases, neo-Hookean, nu 0.35: the default",
      [](const TetMesh& mesh) { return recovering(mesh, 0.35); }},
     {"stiff", "two phases, neo-Hookean, nu 0.49", [](const TetMesh& mesh) { return recovering(mesh, 0.49); }},
     {"recovering-springs", "two phases, springs and volumes near rest, nu 0.35",
      [](const TetMesh& mesh) { return recovering(mesh, 0.35, ElasticModel::springs_volumes); }},
     {"neo-hookean", "one phase, nu 0.35",
      [](const TetMesh& mesh) { return elastic(mesh, 0.35, ElasticModel::neo_hookean); }},
     {"neo-hookean-0", "one phase, nu 0",
      [](const TetMesh& mesh) { return elastic(mesh, 0, ElasticModel::neo_hookean); }},
     {"springs+areas+volumes", "one phase, nu 0.35",
      [](const TetMesh& mesh) { return elastic(mesh, 0.35, ElasticModel::springs_areas_volumes); }},
     {"springs+volumes", "one phase, K 15 mu v_e of lengths and 0.75 mu V_t of volumes", springs_and_volumes},
     {"springs", "one phase, lengths alone",
      [](const TetMesh& mesh) { return elastic(mesh, spring_poisson, ElasticModel::springs_volumes); }}}};

}  // namespace

std::span<const StudyMaterial> study_materials() { return materials; }

const StudyMaterial& find_material(std::string_view name) {
  std::string choices;
  for (const StudyMaterial& material : materials) {
    if (material.name == name) return material;
    choices += (choices.empty() ? "" : ", ") + std::string(material.name);
  }
  throw std::invalid_argument("unknown material \"" + std::string(name) + "\", must be one of " + choices);
}

}  // namespace penalty::study
