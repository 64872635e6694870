#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "convert.h"
#include "nodes.h"
#include "penalty/bullet/soft_body.h"
#include "penalty/fields/batch_loops.h"
#include "penalty/math/text.h"

namespace penalty {
namespace {

struct BodyLink {
  Edge edge;
  Real rest_length;  // [m]
  Real share;        // of the material's stiffness
  bool against_bending;
};

template <std::size_t N>
std::array<int, N> in_order(std::array<int, N> stencil) {
  std::sort(stencil.begin(), stencil.end());
  return stencil;
}

template <std::size_t N>
bool contains(const std::vector<std::array<int, N>>& sorted, const std::array<int, N>& stencil) {
  return std::binary_search(sorted.begin(), sorted.end(), in_order(stencil));
}

/// What is made of what, by the indices of the nodes.
class BodyParts {
 public:
  explicit BodyParts(const btSoftBody& body) : body_(body), positions_(3, body.m_nodes.size()) {
    for (int i = 0; i < body.m_nodes.size(); ++i) positions_.col(i) = to_vector(body.m_nodes[i].m_x);
    take_tetrahedra();
    take_faces();
    take_links();
  }

  const Eigen::Matrix3Xd& positions() const { return positions_; }
  const std::vector<Tetrahedron>& tetrahedra() const { return tetrahedra_; }
  const std::vector<Triangle>& triangles() const { return triangles_; }  // beside the tetrahedra
  const std::vector<BodyLink>& links() const { return links_; }          // that belong to no tetrahedron

  /// Of the nodes in these stencils; a pinned one counts as the others do on average [kg].
  template <class Stencils, class Nodes>
  Real mass_of(const Stencils& stencils, const Nodes& nodes_of) const {
    std::vector<bool> seen(static_cast<std::size_t>(positions_.cols()), false);
    Real sum = 0;
    int free = 0, all = 0;
    for (const auto& stencil : stencils)
      for (const int node : nodes_of(stencil)) {
        if (seen[node]) continue;
        seen[node] = true;
        ++all;
        if (body_.m_nodes[node].m_im > 0) {
          sum += 1 / static_cast<Real>(body_.m_nodes[node].m_im);
          ++free;
        }
      }
    return free > 0 ? sum * all / free : 0;
  }

 private:
  template <std::size_t N, class Element>
  std::array<int, N> stencil_of(const Element& element, const char* name, int index) const {
    std::array<int, N> stencil;
    for (std::size_t k = 0; k < N; ++k) {
      stencil[k] = index_of(body_, element.m_n[k]);
      if (stencil[k] < 0) fail(name, index, "joins a node that is not of this body");
    }
    return stencil;
  }

  [[noreturn]] static void fail(const char* name, int index, const std::string& what) {
    throw std::invalid_argument(std::string("field of a soft body: ") + name + " " + std::to_string(index) + " " +
                                what);
  }

  void take_tetrahedra() {
    for (int t = 0; t < body_.m_tetras.size(); ++t)
      tetrahedra_.push_back(stencil_of<4>(body_.m_tetras[t], "tetrahedron", t));
    orient(positions_, tetrahedra_);
  }

  void take_faces() {
    const std::vector<Triangle> sides = faces_of(tetrahedra_);
    for (int f = 0; f < body_.m_faces.size(); ++f) {
      const Triangle face = stencil_of<3>(body_.m_faces[f], "face", f);
      const bool is_flat = areas_of(positions_, std::span(&face, 1))[0] == 0;
      if (!is_flat && !contains(sides, face)) triangles_.push_back(face);
    }
    drop_doubles(triangles_, [](const Triangle& triangle) { return in_order(triangle); });
  }

  void take_links() {
    const std::vector<Edge> of_solids = edges_of(tetrahedra_);
    for (int l = 0; l < body_.m_links.size(); ++l) {
      const btSoftBody::Link& link = body_.m_links[l];
      const Edge edge = in_order(stencil_of<2>(link, "link", l));
      if (edge[0] == edge[1]) fail("link", l, "joins node " + std::to_string(edge[0]) + " with itself");
      if (contains(of_solids, edge)) continue;
      const Real rest_length = link.m_rl, share = link.m_material ? static_cast<Real>(link.m_material->m_kLST) : 1;
      if (!(rest_length > 0 && std::isfinite(rest_length)))
        fail("link", l, "has rest length " + to_text(rest_length) + " m, must be positive and finite");
      if (!(share >= 0 && std::isfinite(share)))
        fail("link", l, "has m_kLST " + to_text(share) + ", must be zero or positive");
      links_.push_back({edge, rest_length, share, link.m_bbending != 0});
    }
    drop_doubles(links_, [](const BodyLink& link) { return link.edge; });
  }

  // Of equal ones the first stays, in its place.
  template <class Element, class Key>
  static void drop_doubles(std::vector<Element>& elements, const Key& key_of) {
    std::vector<std::pair<decltype(key_of(elements[0])), std::size_t>> keys;
    keys.reserve(elements.size());
    for (const Element& element : elements) keys.emplace_back(key_of(element), keys.size());
    std::sort(keys.begin(), keys.end());
    std::vector<bool> stays(elements.size(), true);
    for (std::size_t k = 1; k < keys.size(); ++k)
      if (keys[k].first == keys[k - 1].first) stays[keys[k].second] = false;
    std::size_t kept = 0;
    for (std::size_t k = 0; k < elements.size(); ++k)
      if (stays[k]) elements[kept++] = elements[k];
    elements.resize(kept);
  }

  const btSoftBody& body_;
  Eigen::Matrix3Xd positions_;
  std::vector<Tetrahedron> tetrahedra_;
  std::vector<Triangle> triangles_;
  std::vector<BodyLink> links_;
};

/// What is said, or else mass over density over `extent` [m² or m].
Real size_of(const std::optional<Real>& said, const char* name, Real mass, Real density, Real extent) {
  if (said) {
    if (!(*said > 0 && std::isfinite(*said)))
      throw std::invalid_argument(std::string("field of a soft body: ") + name + " is " + to_text(*said) +
                                  ", must be positive and finite");
    return *said;
  }
  if (mass == 0)
    throw std::invalid_argument(std::string("field of a soft body: all its nodes are pinned, so no mass says its ") +
                                name + ": give options." + name);
  return mass / (density * extent);
}

}  // namespace

PotentialField make_field(const btSoftBody& body, const Material& material, const BodyFieldOptions& options) {
  material.check(0, "a soft body");
  const BodyParts parts(body);
  PotentialField field = parts.tetrahedra().empty()
                             ? PotentialField(parts.positions())
                             : make_elastic_field(parts.positions(), parts.tetrahedra(), material, options.model);

  std::vector<Edge> edges;  // of the sheet
  if (!parts.triangles().empty()) {
    Real area = 0;
    for (const Real share : areas_of(parts.positions(), parts.triangles())) area += share;
    const Real thickness = size_of(options.thickness, "thickness",
                                   parts.mass_of(parts.triangles(), [](const Triangle& triangle) { return triangle; }),
                                   material.density, area);
    PotentialField sheet = make_sheet_field(parts.positions(), parts.triangles(), material,
                                            {.thickness = thickness, .bending = options.bending});
    auto& springs = sheet.batch<Length>();
    edges = springs.stencils();
    for (const BodyLink& link : parts.links()) {
      const auto found = std::lower_bound(edges.begin(), edges.end(), link.edge);
      if (found == edges.end() || *found != link.edge) continue;
      const int e = static_cast<int>(found - edges.begin());
      springs.kind(e).inverse_rest_length = 1 / link.rest_length;
      if (link.share > 0)
        springs.set_stiffness(e, link.share * springs.stiffness(e));
      else
        springs.set_enabled(e, false);
    }
    field.add(std::move(sheet));
  }

  std::vector<BodyLink> ropes;
  Real length = 0;
  for (const BodyLink& link : parts.links())
    if (link.share > 0 && !contains(edges, link.edge) && !(link.against_bending && !edges.empty())) {
      ropes.push_back(link);
      length += link.rest_length;
    }
  if (!ropes.empty()) {
    const Real section =
        size_of(options.section, "section", parts.mass_of(ropes, [](const BodyLink& link) { return link.edge; }),
                material.density, length);
    auto springs = make_batch<Length>(field.num_particles());
    for (const auto& [edge, rest_length, share, against_bending] : ropes) {
      Points<2> points;
      points << parts.positions().col(edge[0]), parts.positions().col(edge[1]);
      Length kind = Length::at_rest(points);
      kind.inverse_rest_length = 1 / rest_length;
      springs->add(edge, kind, share * material.young * section * rest_length);
    }
    if (material.damping > 0) springs->set_damping_time(material.damping);
    field.add(std::move(springs));
  }
  if (field.potentials().empty())
    throw std::invalid_argument("field of a soft body: it has no tetrahedra, faces or links");
  return field;
}

}  // namespace penalty
