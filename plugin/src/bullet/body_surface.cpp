// The surface with which a soft body touches.
#include "penalty/bullet/body_surface.h"

#include <algorithm>

#include "held_bodies.h"
#include "nodes.h"
#include "penalty/mesh/embed.h"
#include "surfaces.h"

namespace penalty {
namespace {

// Those none of whose corners lies in what broke.
std::vector<Triangle> whole_triangles(const BodySurface& surface, const PotentialField& field) {
  const BrokenElements broken(field);
  std::vector<Triangle> triangles = surface.triangles;
  std::erase_if(triangles, [&](const Triangle& corners) {
    return std::any_of(corners.begin(), corners.end(), [&](int corner) {
      const WeightedPoint& point = surface.points[corner];
      return broken.cut({point.particles.data(), static_cast<std::size_t>(point.size)});
    });
  });
  return triangles;
}

// Outer sides of the tetrahedra that are whole.
std::vector<Triangle> skin_of(const btSoftBody& body, const PotentialField& field) {
  const BrokenElements broken(field);
  std::vector<Tetrahedron> tetrahedra = tetrahedra_of(body, field);
  std::erase_if(tetrahedra, [&](const Tetrahedron& t) { return broken.cut(t); });
  return boundary_faces(tetrahedra);
}

// Its own if it has one, else faces, those of tetrahedra, links or nodes: the first that there are.
std::shared_ptr<ContactSurface> make_surface(const HeldBody& held) {
  const btSoftBody& body = *held.body;
  const PackedVectors& rest = held.field.rest_positions();
  if (const BodySurface& own = held.options.surface; !own.points.empty())
    return std::make_shared<ContactSurface>(own.points, whole_triangles(own, held.field), std::vector<Edge>{}, rest);
  std::vector<int> point_of(body.m_nodes.size(), -1);
  std::vector<WeightedPoint> points;
  const auto point_at = [&](const btSoftBody::Node* node) {
    const int i = index_of(body, node);
    if (point_of[i] < 0) {
      point_of[i] = static_cast<int>(points.size());
      points.push_back(WeightedPoint::at_particle(i));
    }
    return point_of[i];
  };
  std::vector<Triangle> triangles;
  std::vector<Edge> edges;
  if (held.torn_faces.has_own(body))
    for (int k = 0; k < body.m_faces.size(); ++k) {
      const auto& n = body.m_faces[k].m_n;
      if (n[0] == n[1]) continue;  // torn
      triangles.push_back({point_at(n[0]), point_at(n[1]), point_at(n[2])});
    }
  else
    for (const auto& [a, b, c] : skin_of(body, held.field))
      triangles.push_back({point_at(&body.m_nodes[a]), point_at(&body.m_nodes[b]), point_at(&body.m_nodes[c])});
  for (const auto& [face, corners] : held.torn_faces.torn())
    for (const int i : corners) point_at(&body.m_nodes[i]);
  if (points.empty())
    for (int k = 0; k < body.m_links.size(); ++k)
      edges.push_back({point_at(body.m_links[k].m_n[0]), point_at(body.m_links[k].m_n[1])});
  if (points.empty())
    for (int i = 0; i < body.m_nodes.size(); ++i) point_at(&body.m_nodes[i]);
  return std::make_shared<ContactSurface>(std::move(points), std::move(triangles), edges, rest);
}

}  // namespace

BodySurface BodySurface::of(const EmbeddedSurface& embedded) {
  BodySurface surface{.points = std::vector<WeightedPoint>(embedded.stencils.size()),
                      .triangles = embedded.surface.triangles};
  for (std::size_t v = 0; v < surface.points.size(); ++v) {
    surface.points[v] = {.particles = embedded.stencils[v], .weights = {}, .size = 4};
    for (int k = 0; k < 4; ++k) surface.points[v].weights[k] = embedded.weights(k, static_cast<Eigen::Index>(v));
  }
  return surface;
}

ContactSurface& surface_of(HeldBody& held) {
  const std::array<int, 2> size{held.body->m_faces.size(), held.body->m_links.size()};
  if (!held.surface || held.surface_size != size) {
    held.surface = make_surface(held);
    held.surface_size = size;
  }
  held.surface->margin = held.margin();
  held.surface->friction = held.body->m_cfg.kDF;
  return *held.surface;
}

}  // namespace penalty
