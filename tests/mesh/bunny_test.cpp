// The Stanford bunny of Debian's glmark2-data: a real surface of 69 666 triangles.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>

#include "penalty/mesh/embed.h"
#include "penalty/mesh/read_surface.h"

namespace penalty::testing {
namespace {

const std::filesystem::path bunny_file = "/usr/share/glmark2/models/bunny.obj";

TriangleSurface read_bunny() {
  if (!std::filesystem::exists(bunny_file))
    throw std::runtime_error(bunny_file.string() + " is missing: apt-get install glmark2-data");
  return read_surface(bunny_file);
}

TEST(Bunny, IsClosedAndTwoUnitsAcross) {
  const TriangleSurface bunny = read_bunny();
  EXPECT_EQ(bunny.triangles.size(), 69666u);
  EXPECT_EQ(bunny.vertices.cols(), 34835);
  EXPECT_EQ(static_cast<int>(bunny.vertices.cols()) - static_cast<int>(edges_of(bunny.triangles).size()) +
                static_cast<int>(bunny.triangles.size()),
            2)
      << "Euler characteristic of a sphere";
  EXPECT_NEAR(volume(bunny), 1.5998, 1e-4);  // what the file gives; no other source
  const Vector3 size = bunny.vertices.rowwise().maxCoeff() - bunny.vertices.rowwise().minCoeff();
  EXPECT_NEAR(size.maxCoeff(), 2, 1e-5);
}

TEST(Bunny, IsCarriedByItsLattice) {
  const TriangleSurface bunny = read_bunny();
  for (int cells : {8, 12, 20, 24}) {
    SCOPED_TRACE(cells);
    const auto start = std::chrono::steady_clock::now();
    const EmbeddedSurface e = embed(bunny, {.cells = cells});
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    RecordProperty("seconds_" + std::to_string(cells), std::to_string(seconds.count()));
    EXPECT_LT(seconds.count(), 30) << "0.2 s on an idle machine; this bound only catches a wrong order of growth";
    EXPECT_GE(e.weights.minCoeff(), -1e-9);
    EXPECT_LT((skin(e, e.lattice.vertices) - bunny.vertices).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_GT(volume(e.lattice), volume(bunny));
    EXPECT_LT(volume(e.lattice), volume(bunny) * (1 + 6.0 / cells));
    const MeshQuality q = quality(e.lattice);
    EXPECT_LT(q.edge_ratio, 1.155);
    EXPECT_GT(q.smallest_dihedral, 1.047);  // 60 degrees
    const Real spacing = 2.0 / cells;
    const std::vector<int> samples = contact_samples(e, spacing);
    EXPECT_GT(samples.size(), 1.0 * cells * cells);  // a surface some 10 units square in discs of one spacing
    EXPECT_LT(samples.size(), 3.0 * cells * cells);
  }
}

}  // namespace
}  // namespace penalty::testing
