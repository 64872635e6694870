// What may touch is never left out: against all pairs of features, one by one.
#include "penalty/contact/surface_pair.h"

#include <set>

#include "contact/surfaces.h"

namespace penalty::testing {
namespace {

using Key = std::array<int, 6>;  // edges or not, from b or not, points

Key key_of(const FeaturePair& q) { return {q.are_edges, q.from_b, q.points[0], q.points[1], q.points[2], q.points[3]}; }

// All pairs that may come as near as the thickness that rest shapes leave, at the velocities of their points, within h.
std::set<Key> all_that_may_touch(const SurfacePair& pair, Real h) {
  std::set<Key> found;
  const auto add = [&](FeaturePair q) {
    Real thickness = pair.kept_distance();
    if (pair.is_self()) {
      const auto at = [&](int k) { return pair.a().rest_position(q.points[k]); };
      const Real rest = (q.are_edges ? closest_points_of_edges(at(0), at(1), at(2), at(3))
                                     : closest_points_of_triangle(at(0), at(1), at(2), at(3)))
                            .difference.norm();
      thickness = std::min(thickness, 0.8 * rest);
    }
    const int size_of_first = q.are_edges ? 2 : 1;
    Real fastest = 0;
    for (int i = 0; i < size_of_first; ++i)
      for (int j = size_of_first; j < 4; ++j)
        fastest =
            std::max(fastest, (pair.first(q).velocity(q.points[i]) - pair.second(q).velocity(q.points[j])).norm());
    if (pair.closest(q).difference.norm() <= thickness + h * fastest) found.insert(key_of(q));
  };
  for (const bool from_b : {false, true}) {
    if (from_b && pair.is_self()) continue;
    const ContactSurface &one = from_b ? pair.b() : pair.a(), &two = from_b ? pair.a() : pair.b();
    for (int i = 0; i < one.num_points(); ++i)
      for (const auto& [t0, t1, t2] : two.triangles())
        if (!pair.is_self() || (t0 != i && t1 != i && t2 != i))
          add({.points = {i, t0, t1, t2}, .are_edges = false, .from_b = from_b});
  }
  for (std::size_t i = 0; i < pair.a().edges().size(); ++i)
    for (std::size_t j = pair.is_self() ? i + 1 : 0; j < pair.b().edges().size(); ++j) {
      const Edge &p = pair.a().edges()[i], &q = pair.b().edges()[j];
      if (pair.is_self() && (p[0] == q[0] || p[0] == q[1] || p[1] == q[0] || p[1] == q[1])) continue;
      add({.points = {p[0], p[1], q[0], q[1]}, .are_edges = true});
    }
  return found;
}

// Surfaces that drift at random velocities, together and apart.
struct Drifting {
  TriangleSurface mesh_a, mesh_b;
  ContactSurface a = surface_of(mesh_a), b = surface_of(mesh_b);
  PackedVectors xa = pack(mesh_a.vertices), xb = pack(mesh_b.vertices), va = 0 * xa, vb = 0 * xb;

  void begin(SurfacePair& pair) {
    a.begin_step(xa);
    b.begin_step(xb);
    a.take_velocities(va);
    b.take_velocities(vb);
    pair.begin_step();
  }
  void drift(Real h) {
    a.drift(h);
    b.drift(h);
    xa += h * va;
    xb += h * vb;
    a.take_positions(xa);
    b.take_positions(xb);
  }
};

// Edges are given as the search found them: either first.
std::set<Key> visited(SurfacePair& pair) {
  std::set<Key> found;
  pair.visit_near([&](FeaturePair& q, Real) {
    pair.find_difference(q);  // what is far by then is left out until it may have come near
    Key key = key_of(q);
    if (pair.is_self()) key[1] = 0;
    found.insert(key);
    if (q.are_edges && pair.is_self()) found.insert({1, 0, q.points[2], q.points[3], q.points[0], q.points[1]});
  });
  return found;
}

TEST(SurfacePair, LeavesNothingOutThatMayTouch) {
  Drifting s{make_sphere(0.5, 4), make_sphere(0.5, 3)};
  s.a.margin = s.b.margin = 0.05;
  SurfacePair pair(s.a, s.b);
  Random random(5);
  for (int i = 0; i < s.xb.cols(); ++i) s.xb.col(i).head<3>() += Vector3(1.2, 0.1, 0);
  std::size_t seen = 0, most = 0;
  constexpr Real h = 0.002;
  for (int step = 0; step < 40; ++step) {
    s.begin(pair);
    for (int substep = 0; substep < 10; ++substep) {
      const Vector3 closing(std::cos(0.1 * step) * 2, 0, 0);
      for (int i = 0; i < s.va.cols(); ++i) s.va.col(i).head<3>() = closing + random.vector(0.5);
      for (int i = 0; i < s.vb.cols(); ++i) s.vb.col(i).head<3>() = -closing + random.vector(0.5);
      s.a.take_velocities(s.va);
      s.b.take_velocities(s.vb);
      pair.refresh(h, h * (10 - substep));
      const std::set<Key> expected = all_that_may_touch(pair, h), found = visited(pair);
      for (const Key& key : expected) ASSERT_TRUE(found.contains(key)) << "step " << step << ", substep " << substep;
      seen += expected.size();
      most = std::max(most, found.size());
      s.drift(h);
    }
  }
  EXPECT_GT(seen, 1000u);
  EXPECT_LT(most, s.a.points().size() * s.b.triangles().size() / 4) << "and leaves most out that may not";
}

TEST(SurfacePair, OfASurfaceWithItselfLeavesNothingOut) {
  Drifting s{make_sheet(1, 1, 8, 8), make_sheet(1, 1, 1, 1)};
  s.a.margin = 0.03;
  SurfacePair pair(s.a, s.a);
  Random random(6);
  std::size_t seen = 0;
  constexpr Real h = 0.002;
  for (int step = 0; step < 25; ++step) {
    s.begin(pair);
    for (int substep = 0; substep < 10; ++substep) {
      for (int i = 0; i < s.va.cols(); ++i) {  // the right half turns over on the left one
        s.va.col(i).head<3>() = random.vector(0.3);
        if (s.mesh_a.vertices(0, i) > 0.5) s.va.col(i).head<3>() += 6 * Vector3(-s.xa(2, i), 0, s.xa(0, i) - 0.5);
      }
      s.a.take_velocities(s.va);
      pair.refresh(h, h * (10 - substep));
      const std::set<Key> expected = all_that_may_touch(pair, h), found = visited(pair);
      for (const Key& key : expected) ASSERT_TRUE(found.contains(key)) << "step " << step << ", substep " << substep;
      seen += expected.size();
      s.drift(h);
    }
  }
  EXPECT_GT(seen, 1000u);
}

TEST(SurfacePair, WithARigidBodyThatTurnsLeavesNothingOut) {
  Drifting s{make_sphere(0.5, 6), make_sheet(1, 1, 1, 1)};
  std::vector<Vector3> points;
  std::vector<Edge> edges;
  for (int k = 0; k < 20; ++k) {  // a star of needles
    points.push_back(Vector3::Zero());
    points.emplace_back(Vector3(std::cos(k), std::sin(2 * k), std::cos(3 * k)).normalized());
    edges.push_back({2 * k, 2 * k + 1});
  }
  ContactSurface star(points, edges, 0.04);
  s.a.margin = star.margin = 0.05;
  SurfacePair pair(s.a, star);
  Random random(7);
  Vector3 origin(1.7, 0, 0);
  Matrix3 rotation = Matrix3::Identity();
  std::size_t seen = 0, most = 0;
  constexpr Real h = 0.002;
  for (int step = 0; step < 40; ++step) {
    s.a.begin_step(s.xa);
    star.begin_step(origin, rotation);
    pair.begin_step();
    for (int substep = 0; substep < 10; ++substep) {
      const Vector3 velocity(-std::cos(0.1 * step) * 2, 0, 0), spin = Vector3(3, 5, -2) + random.vector(3);
      for (int i = 0; i < s.va.cols(); ++i) s.va.col(i).head<3>() = random.vector(0.5);
      s.a.take_velocities(s.va);
      star.take_velocities(velocity, spin);
      pair.refresh(h, h * (10 - substep));
      const std::set<Key> expected = all_that_may_touch(pair, h), found = visited(pair);
      for (const Key& key : expected) ASSERT_TRUE(found.contains(key)) << "step " << step << ", substep " << substep;
      seen += expected.size();
      most = std::max(most, found.size());
      s.a.drift(h);
      star.drift(h);
      s.xa += h * s.va;
      s.a.take_positions(s.xa);
      origin += h * velocity;
      rotation = Eigen::AngleAxis<Real>(h * spin.norm(), spin.normalized()).toRotationMatrix() * rotation;
      star.take_positions(origin, rotation);
    }
  }
  EXPECT_GT(seen, 1000u);
  EXPECT_LT(most, s.a.triangles().size() * points.size() / 4) << "and leaves most out that may not";
}

TEST(SurfacePair, KeepsTheMeanOfTheMarginsWithinWhatTheMeshCanCarry) {
  Drifting s{make_sphere(1, 4), make_sphere(1, 4)};
  const Real edge = s.a.mean_edge();
  SurfacePair pair(s.a, s.b);
  const auto thickness = [&](Real one, Real two) {
    s.a.margin = one;
    s.b.margin = two;
    pair.begin_step();
    return pair.thickness();
  };
  EXPECT_NEAR(thickness(0.02, 0.04), 0.03, 1e-15);
  EXPECT_NEAR(thickness(1, 1), 0.3 * edge, 1e-15);
  EXPECT_NEAR(thickness(0, 0), 0.01 * edge, 1e-15);
}

TEST(SurfacePair, SeesWhatPiercesAndWhatIsThenInside) {
  Drifting s{make_sphere(0.5, 4), make_sphere(0.2, 2)};
  s.a.margin = s.b.margin = 0.01;
  SurfacePair pair(s.a, s.b);
  s.begin(pair);
  EXPECT_FALSE(pair.is_tangled()) << "wholly inside: there it stays";
  EXPECT_TRUE(pair.enclosed().empty());
  for (int i = 0; i < s.xb.cols(); ++i) s.xb(0, i) += 0.5;
  s.begin(pair);
  EXPECT_TRUE(pair.is_tangled());
  EXPECT_GT(pair.enclosed().size(), 0u);
  for (const EnclosedPoint& enclosed : pair.enclosed())
    EXPECT_LT((enclosed.of_b ? s.b : s.a).position(enclosed.point).norm(), 0.51);
  for (int i = 0; i < s.xb.cols(); ++i) s.xb(0, i) += 0.5;
  s.begin(pair);
  EXPECT_FALSE(pair.is_tangled());
  EXPECT_TRUE(pair.enclosed().empty());
}

}  // namespace
}  // namespace penalty::testing
