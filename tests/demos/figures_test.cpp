// The figures: what they claim to show is so.
#include <gtest/gtest.h>

#include <map>

#include "scenes/scene_setup.h"
#include "scenes/unbroken_triangles.h"

namespace penalty::demo {
namespace {

TEST(PotentialFieldFigures, ForcesStandOnTheSurfacesAndAgreeWithTheClosedForm) {
  const std::vector<Figure> figures = find_scene("potential_field").figures({.cells = 48});
  ASSERT_EQ(figures.size(), 2u);
  std::map<std::string, double> facts;
  for (const Figure& figure : figures)
    for (const Fact& fact : figure.facts) facts[fact.name] = fact.value;
  EXPECT_LT(facts.at("largest_force_error"), 1e-8) << "against differences of the energy";
  EXPECT_LT(facts.at("largest_angle_to_normal_degrees"), 6) << "degrees, of a surface of flat triangles";
  EXPECT_GT(facts.at("largest_angle_to_normal_degrees"), 0);
  EXPECT_LT(facts.at("largest_volume_force_error"), 1e-14);
  EXPECT_LT(facts.at("largest_net_force"), 1e-15);
}

TEST(PotentialFieldFigures, ShowShellsAndArrows) {
  for (const Figure& figure : find_scene("potential_field").figures({.cells = 24})) {
    SCOPED_TRACE(figure.name);
    EXPECT_GE(figure.frame.surfaces.size(), 3u);
    std::size_t arrows = 0;
    for (const render::RigidBody& body : figure.frame.bodies)
      arrows += std::holds_alternative<render::Cone>(body.shape) ? 1 : 0;
    EXPECT_GE(arrows, 8u);
    EXPECT_FALSE(figure.overlay.title.empty());
    EXPECT_FALSE(render::bounds_of(figure.frame).empty());
  }
}

TEST(PotentialFieldFigures, RefuseAMeshAndSillyGrids) {
  const auto figures = find_scene("potential_field").figures;
  EXPECT_THROW(figures({.mesh = "bunny"}), std::invalid_argument);
  EXPECT_THROW(figures({.cells = 5}), std::invalid_argument);
}

TEST(ParticleEnergies, AddUpToTheEnergyOfTheField) {
  const BodyMesh body = load_body({.cells = 4}, "box");
  PotentialField field = make_elastic_field(body.vertices(), body.solid().tetrahedra, 2.0);
  const PackedVectors x = pack(Vector3(1.2, 0.9, 1).asDiagonal() * body.vertices());
  ASSERT_GT(field.energy(x), 1);
  EXPECT_NEAR(particle_energies(field, x).sum(), field.energy(x), 1e-12 * field.energy(x));
  EXPECT_NEAR(body.vertex_shares().sum(), 8, 1e-12);
  field.add(make_elastic_field(body.vertices(), body.solid().tetrahedra, 1.0));
  EXPECT_NEAR(particle_energies(field, x).sum(), field.energy(x), 1e-12 * field.energy(x));
}

}  // namespace
}  // namespace penalty::demo
