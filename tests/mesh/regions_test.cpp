#include "penalty/mesh/regions.h"

#include "files.h"

namespace penalty::testing {
namespace {

TetMesh three_groups() {
  TetMesh mesh = two_tetrahedra();
  mesh.source = "bar.msh";
  mesh.regions = {{"upper", {0}}, {"lower", {1}}, {"all", {0, 1}}};
  mesh.vertex_sets = {{"tip", {4}}};
  return mesh;
}

TEST(Regions, GiveEachTetrahedronItsMaterial) {
  const TetMesh mesh = three_groups();
  const Materials both = materials_of(mesh, {{"lower", {.young = 3}}, {"upper", {.young = 2}}});
  EXPECT_EQ(both.of(0).young, 2);
  EXPECT_EQ(both.of(1).young, 3);
  const Materials rest = materials_of(mesh, {{"lower", {.young = 3}}}, Material{.young = 5});
  EXPECT_EQ(rest.of(0).young, 5);
  EXPECT_EQ(rest.of(1).young, 3);
  EXPECT_EQ(materials_of(mesh, {}, Material{.young = 7}).of(1).young, 7);
}

TEST(Regions, AreFoundByName) {
  EXPECT_EQ(three_groups().region("all"), (std::vector<int>{0, 1}));
  EXPECT_EQ(three_groups().vertex_set("tip"), std::vector<int>{4});
}

TEST(Regions, SayWhatIsWrong) {
  TetMesh mesh = three_groups();
  EXPECT_EQ(invalid_argument([&] { materials_of(mesh, {{"upper", {}}, {"middle", {}}}); }),
            "bar.msh: there is no region 'middle'; there is 'upper', 'lower', 'all'");
  EXPECT_EQ(invalid_argument([&] { materials_of(mesh, {{"lower", {}}, {"all", {}}}); }),
            "bar.msh: tetrahedron 1 is in the region 'lower' and in 'all'");
  EXPECT_EQ(invalid_argument([&] { materials_of(mesh, {{"lower", {}}}); }),
            "bar.msh: tetrahedron 0 is in none of the regions named, and there is no material for elsewhere");
  mesh.regions[0].members = {2};
  EXPECT_EQ(invalid_argument([&] { materials_of(mesh, {{"upper", {}}}); }),
            "bar.msh: tetrahedron 2 is outside the mesh, but in its region 'upper'");
  EXPECT_EQ(invalid_argument([&] { two_tetrahedra().vertex_set("tip"); }),
            "mesh: there is no vertex set 'tip', nor any other");
}

}  // namespace
}  // namespace penalty::testing
