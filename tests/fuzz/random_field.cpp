#include "fuzz/random_field.h"

#include "penalty/bullet_penalty.h"

namespace penalty::testing {
namespace {

std::vector<std::vector<int>> all_points(Eigen::Index count) {
  std::vector<std::vector<int>> stencil(1);
  for (int i = 0; i < count; ++i) stencil[0].push_back(i);
  return stencil;
}

/// The closed surface of a mesh, its points numbered from 0, and the particles that these are.
std::pair<std::vector<Triangle>, std::vector<int>> surface_of(const TetMesh& mesh) {
  std::vector<Triangle> triangles = boundary_faces(mesh.tetrahedra);
  std::vector<int> number(static_cast<std::size_t>(mesh.vertices.cols()), -1), particles;
  for (Triangle& t : triangles)
    for (int& v : t) {
      int& known = number[static_cast<std::size_t>(v)];
      if (known < 0) {
        known = static_cast<int>(particles.size());
        particles.push_back(v);
      }
      v = known;
    }
  return {triangles, particles};
}

}  // namespace

RandomField random_field(Chance& chance, const TetMesh& mesh, const UserFault& fault) {
  const auto& vertices = mesh.vertices;
  const auto& tetrahedra = mesh.tetrahedra;
  const auto material = [&chance](Real least_poisson) {
    return Material{.young = chance.number(1e3, 1e6), .poisson = chance.number(least_poisson, 0.48)};
  };
  const int sort = chance.index(13);
  switch (sort) {
    case 0:
      return {make_elastic_field(vertices, tetrahedra, material(0.26))};
    case 1:
      return {make_elastic_field(vertices, tetrahedra, material(0.31), ElasticModel::springs_areas_volumes)};
    case 2:
      return {make_elastic_field(vertices, tetrahedra, material(0.01), ElasticModel::neo_hookean)};
    case 3:
      return {make_recovering_field(vertices, tetrahedra, material(0.1))};
    case 4:
      return {PotentialField(vertices)};
    default:
      break;
  }
  RandomField made{make_elastic_field(vertices, tetrahedra, chance.number(1, 1e3))};
  PotentialField& field = made.field;
  const Real stiffness = chance.number(0.1, 1e2);
  std::vector<Triangle> corners;
  corners.reserve(tetrahedra.size());
  for (const Tetrahedron& t : tetrahedra) corners.push_back({t[0], t[1], t[2]});
  switch (sort) {
    case 5:
      field.add<TetrahedronDihedralAngle>(tetrahedra, stiffness);
      break;
    case 6:
      field.add<CornerAngle>(corners, stiffness);
      field.add<TriangleArea>(corners, stiffness);
      break;
    case 7:
      field.add(ShapeMatch(), all_points(vertices.cols()), stiffness);
      break;
    case 8: {
      const auto [triangles, particles] = surface_of(mesh);
      field.add(EnclosedVolume(triangles), {{particles}}, stiffness);
      break;
    }
    case 9: {
      const std::array<int, 1> point{chance.index(static_cast<int>(vertices.cols()))};
      field.add(
          Distance::pinned({chance.number(0, 1), chance.number(0, 1), chance.number(0, 1)}, chance.number(0.1, 1)),
          {{point}}, stiffness);
      made.keeps_momentum = false;
      break;
    }
    case 10: {
      const auto apart = [&fault](const Points<2>& p) -> Real {
        if (fault.throws) throw UserError();
        if (fault.gives_nan) return std::numeric_limits<Real>::quiet_NaN();
        return (p.col(1) - p.col(0)).squaredNorm();
      };
      std::vector<Edge> edges = edges_of(tetrahedra);
      edges.resize(std::min<std::size_t>(edges.size(), 5));
      field.add(difference_constraint<2>(apart), edges, stiffness);
      made.keeps_momentum = false;  // differences are not exact
      break;
    }
    default:
      break;
  }
  return made;
}

void change_elements(Chance& chance, PotentialField& field) {
  std::vector<ElementBatch*> batches;
  for (const auto& potential : field.potentials())
    if (auto* batch = dynamic_cast<ElementBatch*>(potential.get()); batch && batch->num_elements() > 0)
      batches.push_back(batch);
  if (batches.empty()) return;
  ElementBatch& batch = *chance.pick(batches);
  const int count = static_cast<int>(batch.num_elements());
  const bool outside = chance.manner != Manner::legal && chance.one_in(10);
  const int e = outside ? (chance.one_in(2) ? -1 : count) : chance.index(count);
  // Kinds that are energies of their own have no target, hence no plasticity and no free play that is open.
  const bool is_energy = batch.name() == StableNeoHookean::name || batch.name() == ShapeMatch::name;
  const bool has_target = !is_energy || chance.manner != Manner::legal;
  const int change = has_target ? chance.index(12) : chance.index(5);
  switch (change) {
    case 0:
      return batch.set_stiffness(e, chance.number(1, 1e3));
    case 1:
      return batch.set_damping_time(chance.number(0, 0.05));
    case 2:
      return batch.set_damping_time(e, chance.number(0, 0.05));
    case 3:
      return batch.set_enabled(e, chance.one_in(2));
    case 4:
      return batch.set_breaking({.upper = chance.number(0.5, 2)});
    case 5:
      return batch.set_target(e, chance.number(-0.3, 0.3));
    case 6:
      return batch.set_targets(chance.number(-0.2, 0.2));
    case 7:
      return batch.set_free_play(e, chance.number(-0.2, 0), chance.number(0, 0.2));
    case 8:
      return batch.set_free_play(-infinite, 0);
    case 9:
      return batch.set_plasticity(
          {.yield = chance.number(0, 0.2), .creep = chance.number(0, 50), .limit = chance.number(0, 1)});
    case 10:
      return batch.set_plasticity(e, {.yield = chance.number(0, 0.2), .creep = infinite, .limit = infinite});
    default:
      return batch.set_breaking(e, {.upper = chance.number(0.1, 1), .lower = -chance.number(0.1, 0.9)});
  }
}

}  // namespace penalty::testing
