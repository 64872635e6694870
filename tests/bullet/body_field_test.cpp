// Soft bodies that the plugin did not make, taken over in one line.
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>

#include "bullet/simulation.h"
#include "penalty/mesh/surface_builders.h"
#include "penalty/mesh/write_mesh.h"

namespace penalty::testing {
namespace {

constexpr Real drop = 0.2;  // of the lowest node above the ground at the start [m]

using Helper = std::function<std::unique_ptr<btSoftBody>(btSoftBodyWorldInfo&)>;

std::unique_ptr<btSoftBody> owned(btSoftBody* body) { return std::unique_ptr<btSoftBody>(body); }

// Bullet gives each node 1 kg.
std::unique_ptr<btSoftBody> of_mass(std::unique_ptr<btSoftBody> body, Real mass) {
  body->setTotalMass(static_cast<btScalar>(mass));
  return body;
}

std::unique_ptr<btSoftBody> rope(btSoftBodyWorldInfo& info, int pinned_ends = 0) {
  return of_mass(owned(btSoftBodyHelpers::CreateRope(info, {0, 2, 0}, {1, 2, 0}, 14, pinned_ends)), 1);
}

std::unique_ptr<btSoftBody> patch(btSoftBodyWorldInfo& info, bool diagonals = true) {
  return of_mass(
      owned(btSoftBodyHelpers::CreatePatch(info, {0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {1, 0, 1}, 9, 9, 0, diagonals)), 0.5);
}

std::unique_ptr<btSoftBody> tetgen(btSoftBodyWorldInfo& info, const TetMesh& mesh) {
  std::ostringstream nodes, elements;
  nodes << mesh.vertices.cols() << " 3 0 0\n";
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i) nodes << i << " " << mesh.vertices.col(i).transpose() << "\n";
  elements << mesh.tetrahedra.size() << " 4 0\n";
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    elements << t;
    for (const int node : mesh.tetrahedra[t]) elements << " " << node;
    elements << "\n";
  }
  return owned(btSoftBodyHelpers::CreateFromTetGenData(info, elements.str().c_str(), nullptr, nodes.str().c_str(),
                                                       false, true, true));
}

std::unique_ptr<btSoftBody> vtk(btSoftBodyWorldInfo& info, const TetMesh& mesh) {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("penalty-body-" + std::to_string(getpid()) + ".vtk");
  write_vtk(path, mesh);
  btSoftBody* body = btSoftBodyHelpers::CreateFromVtkFile(info, path.c_str());
  std::filesystem::remove(path);
  return owned(body);
}

std::unique_ptr<btSoftBody> of_triangles(btSoftBodyWorldInfo& info, const TriangleSurface& surface) {
  std::vector<btScalar> coordinates;
  for (const Real c : surface.vertices.reshaped()) coordinates.push_back(static_cast<btScalar>(c));
  return owned(btSoftBodyHelpers::CreateFromTriMesh(info, coordinates.data(), surface.triangles[0].data(),
                                                    static_cast<int>(surface.triangles.size())));
}

std::unique_ptr<btSoftBody> hull(btSoftBodyWorldInfo& info) {
  std::vector<btVector3> corners;
  corners.reserve(8);
  for (int k = 0; k < 8; ++k) corners.emplace_back(k & 1 ? 1 : 0, k & 2 ? 1 : 0, k & 4 ? 1 : 0);
  return owned(btSoftBodyHelpers::CreateFromConvexHull(info, corners.data(), 8));
}

struct Helped {
  const char* name;
  Helper make;
  Real young;              // [Pa]
  bool is_closed = false;  // or solid: it stands, and keeps its shape
};

const Helped helpers[] = {
    {"rope", [](auto& info) { return rope(info); }, 1e6},
    {"patch", [](auto& info) { return patch(info); }, 1e6},
    {"patch_without_diagonals", [](auto& info) { return patch(info, false); }, 1e6},
    {"patch_with_bending_links",
     [](auto& info) {
       auto body = patch(info);
       body->generateBendingConstraints(2);
       return body;
     },
     1e6},
    {"ellipsoid",
     [](auto& info) {
       return of_mass(owned(btSoftBodyHelpers::CreateEllipsoid(info, {0, 0, 0},
                                                               {btScalar(0.5), btScalar(0.4), btScalar(0.5)}, 128)),
                      30);
     },
     1e7, true},
    {"triangle_mesh", [](auto& info) { return of_mass(of_triangles(info, make_sphere(0.5, 2)), 30); }, 1e7, true},
    {"convex_hull", [](auto& info) { return of_mass(hull(info), 60); }, 1e7, true},
    {"tetgen", [](auto& info) { return of_mass(tetgen(info, make_box({1, 1, 1}, {3, 3, 3})), 500); }, 1e6, true},
    {"vtk", [](auto& info) { return of_mass(vtk(info, make_box({1, 1, 1}, {3, 3, 3})), 500); }, 1e6, true},
};

class AdoptedBody : public ::testing::TestWithParam<std::tuple<WorldKind, int>> {};
INSTANTIATE_TEST_SUITE_P(World, AdoptedBody,
                         ::testing::Combine(both_worlds(), ::testing::Range(0, static_cast<int>(std::size(helpers)))),
                         [](const auto& info) {
                           return std::string(helpers[std::get<1>(info.param)].name) + "_" +
                                  world_name(std::get<0>(info.param));
                         });

TEST_P(AdoptedBody, FallsComesToRestAndKeepsItsShape) {
  const auto& [kind, index] = GetParam();
  const Helped& helped = helpers[index];
  Simulation sim(kind);
  sim.set_gravity({0, -g, 0});
  sim.add_ground();
  btSoftBody& body = sim.add(helped.make(sim.info()));
  body.getCollisionShape()->setMargin(btScalar(0.02));  // Bullet's own is 0.25 m
  body.translate({0, static_cast<btScalar>(drop - lowest(body)), 0});
  const std::vector<Vector3> rest = places_of(body);
  sim.penalty().attach(body, make_field(body, {.young = helped.young, .poisson = 0.4, .damping = 0.01}));
  const Real start = sim.totals().energy;
  for (int step = 0; step < 240; ++step) {
    sim.step(frame);
    ASSERT_EQ(sim.penalty().report(body).problem, "") << "step " << step;
    ASSERT_LE(sim.totals().energy, start + 1e-3 * std::abs(start)) << "step " << step;
  }
  EXPECT_LT(sim.penalty().particles(body).velocities.colwise().norm().maxCoeff(), 1e-2);
  const Real margin = body.getCollisionShape()->getMargin();
  EXPECT_GT(lowest(body), -1e-3);
  EXPECT_LT(lowest(body), margin + 0.01);
  // Of whatever distance Bullet has a link for.
  Real largest = 0;
  const std::vector<Vector3> now = places_of(body);
  for (int l = 0; l < body.m_links.size(); ++l) {
    if (body.m_links[l].m_bbending) continue;
    const auto a = body.m_links[l].m_n[0] - &body.m_nodes[0], b = body.m_links[l].m_n[1] - &body.m_nodes[0];
    largest = std::max(largest, std::abs((now[a] - now[b]).norm() / (rest[a] - rest[b]).norm() - 1));
  }
  EXPECT_LT(largest, 0.05);
  const auto height = [](const std::vector<Vector3>& places) {
    const auto [low, high] = std::minmax_element(places.begin(), places.end(),
                                                 [](const Vector3& a, const Vector3& b) { return a.y() < b.y(); });
    return high->y() - low->y();
  };
  if (helped.is_closed) {
    EXPECT_GT(height(now), 0.9 * height(rest));
  }
}

class BodyField : public WorldTest {};
INSTANTIATE_TEST_SUITE_P(World, BodyField, both_worlds(), param_name);

TEST_P(BodyField, OfTetrahedraIsThatOfTheirMesh) {
  const TetMesh mesh = make_box({1, 2, 1}, {2, 3, 2});
  const Material material{.young = 2e5, .poisson = 0.4};
  for (const auto& body : {tetgen(sim.info(), mesh), vtk(sim.info(), mesh)}) {
    const PotentialField field = make_field(*body, material);
    const PotentialField expected = make_elastic_field(mesh.vertices, mesh.tetrahedra, material);
    EXPECT_EQ(field.num_elements(), expected.num_elements());
    const Matrix3 map = turned(1, {1, 2, 3}) * Vector3(1.1, 0.9, 1.2).asDiagonal();
    const PackedVectors x = pack(Eigen::Matrix3Xd(map * mesh.vertices));
    EXPECT_NEAR(field.energy(x), expected.energy(x), 1e-5 * expected.energy(x));
  }
}

TEST_P(BodyField, HangsARopeByItsSection) {
  // Each link carries what hangs below: the rope of E A = E m / (rho L) stretches by sum_k (weight below k) l / E A.
  sim.set_gravity({0, -g, 0});
  auto made = owned(btSoftBodyHelpers::CreateRope(sim.info(), {0, 0, 0}, {0, -2, 0}, 9, 1));  // 11 nodes, 10 of 1 kg
  btSoftBody& body = sim.add(std::move(made));
  const Material material{.young = 1e6, .density = 1000, .damping = 0.05};
  const PotentialField field = make_field(body, material);
  const Real section = 11 / (1000.0 * 2);
  EXPECT_NEAR(field.find<Length>()->stiffness(0), 1e6 * section * 0.2, 1e-5 * 1e6 * section * 0.2);
  sim.penalty().attach(body, make_field(body, material));
  sim.step(frame, 600);
  Real stretch = 0;
  for (int k = 1; k <= 10; ++k) stretch += (11 - k) * g * 0.2 / (1e6 * section);
  EXPECT_NEAR(lowest(body), -2 - stretch, 2e-3 * stretch);
}

TEST_P(BodyField, TakesRestLengthsAndSharesOfStiffnessFromTheLinks) {
  for (const bool is_patch : {false, true}) {
    SCOPED_TRACE(is_patch ? "patch" : "rope");
    const auto body = is_patch ? patch(sim.info()) : rope(sim.info());
    const PotentialField whole = make_field(*body, {});
    body->m_links[3].m_rl *= btScalar(1.25);
    btSoftBody::Material* soft = body->appendMaterial();
    soft->m_kLST = btScalar(0.25);
    body->m_links[5].m_material = soft;
    btSoftBody::Material* none = body->appendMaterial();
    none->m_kLST = 0;
    body->m_links[7].m_material = none;
    const PotentialField field = make_field(*body, {});
    const auto element_of = [&](const PotentialField& of, int link) {
      std::array edge{static_cast<int>(body->m_links[link].m_n[0] - &body->m_nodes[0]),
                      static_cast<int>(body->m_links[link].m_n[1] - &body->m_nodes[0])};
      std::sort(edge.begin(), edge.end());
      const auto& stencils = of.find<Length>()->stencils();
      return static_cast<int>(std::find(stencils.begin(), stencils.end(), edge) - stencils.begin());
    };
    const Batch<Length>&before = *whole.find<Length>(), &after = *field.find<Length>();
    EXPECT_NEAR(after.kinds()[element_of(field, 3)].rest_length(),
                1.25 * before.kinds()[element_of(whole, 3)].rest_length(), 1e-6);
    EXPECT_NEAR(after.stiffness(element_of(field, 5)), before.stiffness(element_of(whole, 5)) / 4,
                0.02 * before.stiffness(element_of(whole, 5)));
    if (is_patch)
      EXPECT_FALSE(after.is_enabled(element_of(field, 7)));
    else
      EXPECT_EQ(after.num_elements() + 1, before.num_elements());
  }
}

TEST_P(BodyField, HasHingesInPlaceOfLinksAgainstBending) {
  const auto plain = patch(sim.info());
  auto bent = patch(sim.info());
  bent->generateBendingConstraints(2);
  ASSERT_GT(bent->m_links.size(), plain->m_links.size());
  EXPECT_EQ(make_field(*bent, {}).num_elements(), make_field(*plain, {}).num_elements());
  auto knotted = rope(sim.info());
  knotted->generateBendingConstraints(2);  // without faces they are all there is
  EXPECT_EQ(make_field(*knotted, {}).num_elements(), static_cast<std::size_t>(knotted->m_links.size()));
}

TEST_P(BodyField, OfASolidWithASkinAndATailIsAllOfThem) {
  TetMesh mesh = make_box({1, 1, 1}, {1, 1, 1});
  const int corner = 0, size = static_cast<int>(mesh.vertices.cols());
  mesh.vertices.conservativeResize(3, size + 3);  // appended later, nodes would leave Bullet's tetrahedra behind
  mesh.vertices.rightCols<3>() << 2, 3, 0, 0, 0, 2, 0, 0, 0;
  auto body = tetgen(sim.info(), mesh);
  const std::size_t solid = make_field(*body, {}).num_elements();
  body->appendLink(corner, size);
  body->appendLink(size, size + 1);
  EXPECT_EQ(make_field(*body, {}).num_elements(), solid + 2);
  body->appendFace(corner, size, size + 2);
  const PotentialField field = make_field(*body, {});
  EXPECT_EQ(field.num_elements(), solid + 1 + 3 + 1);  // a link, and a triangle with its edges and its area
}

std::string refusal(const btSoftBody& body, const BodyFieldOptions& options = {}, const Material& material = {}) {
  try {
    make_field(body, material, options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

// A ball smaller than the faces of a cube falls on one.
TEST_P(BodyField, SolidsWithoutFacesAreTouchedWhereTheirTetrahedraEnd) {
  TetMesh cube = make_box({1, 1, 1}, {1, 1, 1});
  for (const bool tetrahedra_are_left_behind : {false, true}) {
    SCOPED_TRACE(tetrahedra_are_left_behind);
    Simulation own(GetParam());
    own.set_gravity({0, -g, 0});
    btSoftBody& body = own.add(tetgen(own.info(), cube));
    ASSERT_EQ(body.m_faces.size(), 0);
    if (tetrahedra_are_left_behind) {
      const btSoftBody::Node* const first = &body.m_nodes[0];
      while (first == &body.m_nodes[0]) body.appendNode({5, 5, 5}, 1);
      cube.vertices.conservativeResize(3, body.m_nodes.size());
      cube.vertices.rightCols(body.m_nodes.size() - 8).setConstant(5);
      EXPECT_NE(refusal(body), "");
    }
    body.getCollisionShape()->setMargin(btScalar(0.01));
    for (int i = 0; i < body.m_nodes.size(); ++i) body.setMass(i, 0);
    own.penalty().attach(body, make_elastic_field(cube.vertices, cube.tetrahedra, Material{}));
    const btRigidBody& ball = own.add_rigid(std::make_unique<btSphereShape>(btScalar(0.1)), 1, {0.75, 1.2, 0.55});
    own.step(frame, 120);
    EXPECT_NEAR(to_vector(ball.getWorldTransform().getOrigin()).y(), 1.1, 0.02);
  }
}

TEST_P(BodyField, NamesWhatIsWrong) {
  const btVector3 nodes[2] = {{0, 0, 0}, {1, 0, 0}};
  btSoftBody dust(&sim.info(), 2, nodes, nullptr);
  EXPECT_EQ(refusal(dust), "field of a soft body: it has no tetrahedra, faces or links");
  EXPECT_EQ(refusal(*patch(sim.info()), {.thickness = -1}),
            "field of a soft body: thickness is -1, must be positive and finite");
  EXPECT_EQ(refusal(*rope(sim.info()), {.section = 0}),
            "field of a soft body: section is 0, must be positive and finite");
  EXPECT_EQ(refusal(*patch(sim.info()), {}, {.poisson = 0.2}),
            "material: Poisson's ratio is 0.2, must be in [0.333333, 0.5) for sheets");
  EXPECT_EQ(refusal(*rope(sim.info()), {}, {.young = 0}),
            "material: Young's modulus is 0, must be positive and finite [Pa]");
  EXPECT_EQ(refusal(*tetgen(sim.info(), make_box({1, 1, 1}, {1, 1, 1})), {}, {.poisson = 0.6}),
            "material: Poisson's ratio is 0.6, must be in [0, 0.5) for a soft body");
  TetMesh flat = make_box({1, 1, 1}, {1, 1, 1});
  flat.vertices.row(1).setZero();
  EXPECT_EQ(refusal(*tetgen(sim.info(), flat)), "elastic field: tetrahedron 0 has no volume at rest");
  auto held = rope(sim.info());
  for (int i = 0; i < held->m_nodes.size(); ++i) held->setMass(i, 0);
  EXPECT_EQ(refusal(*held),
            "field of a soft body: all its nodes are pinned, so no mass says its section: give options.section");
  auto knot = rope(sim.info());
  knot->m_links[2].m_rl = 0;
  EXPECT_EQ(refusal(*knot), "field of a soft body: link 2 has rest length 0 m, must be positive and finite");
  auto loop = rope(sim.info());
  loop->m_links[1].m_n[1] = loop->m_links[1].m_n[0];
  EXPECT_EQ(refusal(*loop), "field of a soft body: link 1 joins node 1 with itself");
  const auto other = rope(sim.info());
  auto stray = rope(sim.info());
  stray->m_links[4].m_n[0] = &other->m_nodes[0];
  EXPECT_EQ(refusal(*stray), "field of a soft body: link 4 joins a node that is not of this body");
}

}  // namespace
}  // namespace penalty::testing
