#include "mesh_sides.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>

#include <algorithm>

#include "convert.h"
#include "cut_parts.h"
#include "rigid_bodies.h"

namespace penalty {
namespace {

// Calls visit(mesh, rotation, origin) for each mesh of the shape, these being its frame in that of the shape.
template <class Visit>
void visit_meshes(const btCollisionShape& shape, const Matrix3& rotation, const Vector3& origin, const Visit& visit) {
  if (shape.isCompound()) {
    const auto& compound = static_cast<const btCompoundShape&>(shape);
    for (int child = 0; child < compound.getNumChildShapes(); ++child) {
      const btTransform& transform = compound.getChildTransform(child);
      visit_meshes(*compound.getChildShape(child), rotation * to_matrix(transform.getBasis()),
                   rotation * to_vector(transform.getOrigin()) + origin, visit);
    }
  } else if (shape.isConcave() && !shape.isInfinite()) {
    visit(static_cast<const btConcaveShape&>(shape), rotation, origin);
  }
}

Box box_around(const Vector3& point, Real radius) {
  const Vector3 half = Vector3::Constant(radius);
  return {point - half, point + half};
}

// The pairs of particles that an element holds, each once.
std::vector<Edge> mesh_edges(const MeshVisitor& body) {
  std::vector<Edge> edges;
  body.field.visit_elements(body.particles.positions, [&](const ElementView& element) {
    constexpr std::size_t most_points = 4;  // what holds more says nothing of who is next to whom
    if (!element.enabled || element.stencil.size() > most_points) return;
    for (std::size_t k = 0; k < element.stencil.size(); ++k)
      for (std::size_t l = 0; l < k; ++l)
        edges.push_back(
            {std::min(element.stencil[k], element.stencil[l]), std::max(element.stencil[k], element.stencil[l])});
  });
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

}  // namespace

/// A mesh near the body, and what is known of the points of the body relative to it.
struct MeshSides::Mesh {
  int object, number;  // unique id of the object's broadphase proxy, number among its meshes
  const btConcaveShape* shape;
  Matrix3 rotation = Matrix3::Identity();  // to the object
  Vector3 origin = Vector3::Zero();
  bool is_near = true;                                       // in this step
  std::vector<Vector3> positions = {}, last_positions = {};  // of the points, in the frame of the mesh [m]
  std::vector<char> is_wrong = {};                           // the side that the point is on
  Real reach = 0, last_reach = 0;                            // [m]
  Real extent = 0;                                           // diagonal of the box of the points [m]
  Box surface = {};                                          // around the mesh
  std::vector<MeshTriangle> triangles = {};                  // of the last search

  std::vector<MeshTriangle>& triangles_in(const Box& box) {
    triangles.clear();
    append_triangles(*shape, box, triangles);
    return triangles;
  }
  bool is_passed(const Vector3& from, const Vector3& to) {
    Box box;
    box.add(from);
    box.add(to);
    return crosses(triangles_in(box), from, to);
  }

  void follow(const MeshVisitor& body, const Matrix3& to_world, const Vector3& world_origin, Real new_reach);
  bool has_jumped() const;
  void place(const MeshVisitor& body, const std::vector<Vector3>& particles);
  bool append_way_back(const Vector3& x, Real radius, std::vector<SurfacePoint>& found);
};

// `to_world`, `world_origin`: the frame of the mesh in the world.
void MeshSides::Mesh::follow(const MeshVisitor& body, const Matrix3& to_world, const Vector3& world_origin,
                             Real new_reach) {
  const auto to_mesh = [&](const Vector3& x) { return Vector3(to_world.transpose() * (x - world_origin)); };
  const auto take_particles = [&](std::vector<Vector3>& particles) {
    particles.resize(body.particles.inverse_masses.size());
    for (std::size_t i = 0; i < particles.size(); ++i)
      particles[i] = to_mesh(body.particles.positions.col(static_cast<Eigen::Index>(i)).head<3>());
  };
  std::swap(positions, last_positions);
  if (body.points.empty()) {
    take_particles(positions);
  } else {
    positions.clear();
    for (const WeightedPoint& point : body.points) positions.push_back(to_mesh(point.of(body.particles.positions)));
  }
  Box box;
  for (const Vector3& x : positions) box.add(x);
  btVector3 low, high;
  shape->getAabb(btTransform::getIdentity(), low, high);
  const Vector3 pad = Vector3::Constant(1e-6);  // more than what side_of shifts points by
  surface = {to_vector(low) - pad, to_vector(high) + pad};
  is_near = surface.overlaps(box, new_reach);
  if (!is_near) return;
  extent = (box.high - box.low).norm();
  last_reach = reach;
  reach = new_reach;
  if (last_positions.size() == positions.size() && !has_jumped()) return;
  if (body.points.empty()) {
    place(body, positions);
  } else {
    std::vector<Vector3> particles;
    take_particles(particles);
    place(body, particles);
  }
  last_positions = positions;
}

// Most points are elsewhere: somebody has put the body, or the mesh, there.
bool MeshSides::Mesh::has_jumped() const {
  const Real limit = std::max(reach, last_reach);
  std::size_t far = 0;
  for (std::size_t k = 0; k < positions.size(); ++k)
    far += (positions[k] - last_positions[k]).squaredNorm() > limit * limit;
  return 2 * far > positions.size();
}

void MeshSides::Mesh::place(const MeshVisitor& body, const std::vector<Vector3>& particles) {
  is_wrong.assign(positions.size(), 0);
  Box box;
  for (const Vector3& x : particles) box.add(x);
  if (!box.overlaps(surface, 0)) return;
  const std::vector<char> lesser = lesser_parts(body.particles.inverse_masses, mesh_edges(body), [&](const Edge& edge) {
    Box way;
    for (const int particle : edge) way.add(particles[particle]);
    return way.overlaps(surface, 0) && is_passed(particles[edge[0]], particles[edge[1]]);
  });
  if (body.points.empty()) {
    is_wrong = lesser;
    return;
  }
  for (std::size_t k = 0; k < body.points.size(); ++k) {
    const WeightedPoint& point = body.points[k];
    const auto heaviest = std::max_element(point.weights.begin(), point.weights.begin() + point.size);
    const int particle = point.particles[heaviest - point.weights.begin()];
    is_wrong[k] = (lesser[particle] != 0) != is_passed(particles[particle], positions[k]);
  }
}

// However deep it is, but no further than the body is large.
bool MeshSides::Mesh::append_way_back(const Vector3& x, Real radius, std::vector<SurfacePoint>& found) {
  constexpr Real least = 1e-3;
  for (radius = std::max(radius, least * extent);; radius *= 2) {
    const WayBack way_back =
        penalty::append_way_back(triangles_in(box_around(x, radius)), x, shape->getMargin(), radius, found);
    if (way_back != WayBack::too_far || radius > extent) return way_back == WayBack::found;
  }
}

MeshSides::MeshSides() = default;
MeshSides::~MeshSides() = default;

void MeshSides::forget() {
  meshes_.clear();
  near_.clear();
}

void MeshSides::begin_step() {
  std::erase_if(meshes_, [](const auto& mesh) { return !mesh->is_near; });
  for (const auto& mesh : meshes_) mesh->is_near = false;
}

void MeshSides::approach(const btCollisionObject& object, const Pose& pose, const MeshVisitor& body, Real reach) {
  near_.clear();
  const int id = object.getBroadphaseHandle()->m_uniqueId;
  int number = 0;
  visit_meshes(*object.getCollisionShape(), Matrix3::Identity(), Vector3::Zero(),
               [&](const btConcaveShape& shape, const Matrix3& rotation, const Vector3& origin) {
                 auto known = std::find_if(meshes_.begin(), meshes_.end(), [&](const auto& mesh) {
                   return mesh->object == id && mesh->number == number && mesh->shape == &shape;
                 });
                 if (known == meshes_.end())
                   known = meshes_.insert(
                       known, std::make_unique<Mesh>(Mesh{.object = id, .number = number, .shape = &shape}));
                 ++number;
                 Mesh& mesh = **known;
                 mesh.rotation = rotation;
                 mesh.origin = origin;
                 mesh.follow(body, pose.rotation * rotation, pose.rotation * origin + pose.origin, reach);
                 if (mesh.is_near) near_.push_back(&mesh);
               });
}

bool MeshSides::follows(int point) const {
  return std::any_of(near_.begin(), near_.end(), [&](const Mesh* mesh) {
    Box way;
    way.add(mesh->positions[point]);
    way.add(mesh->last_positions[point]);
    return mesh->is_wrong[point] || way.overlaps(mesh->surface, 0);
  });
}

void MeshSides::append_planes(int point, const Vector3& way, Real margin, Real reach,
                              std::vector<SurfacePoint>& found) {
  for (Mesh* mesh : near_) {
    const Vector3& x = mesh->positions[point];
    char& is_wrong = mesh->is_wrong[point];
    const Real mesh_margin = mesh->shape->getMargin(), radius = reach + mesh_margin;
    const std::size_t begin = found.size();
    Box box = box_around(x, radius);
    box.add(mesh->last_positions[point]);
    if (crosses(mesh->triangles_in(box), mesh->last_positions[point], x)) is_wrong = !is_wrong;
    if (is_wrong) is_wrong = mesh->append_way_back(x, radius, found);
    if (!is_wrong)
      penalty::append_planes(mesh->triangles, {x, mesh->rotation.transpose() * way, margin}, mesh_margin, reach, found);
    for (std::size_t k = begin; k < found.size(); ++k) {
      found[k].point = mesh->rotation * found[k].point + mesh->origin;
      found[k].normal = mesh->rotation * found[k].normal;
    }
  }
}

}  // namespace penalty
