#include "stepping/surface_bodies.h"

namespace penalty::testing {
namespace {

constexpr Real reach = 3;  // how much further than in the step a body may come, where contacts with floors are made

}  // namespace

Body& SurfaceBodies::add(const TetMesh& mesh, Real stiffness, Real mass, const Start& start) {
  return add(make_elastic_field(mesh.vertices, mesh.tetrahedra, stiffness), mesh.vertices,
             boundary_faces(mesh.tetrahedra), mass, start, false);
}

Body& SurfaceBodies::add(const TetMesh& mesh, const Material& material, Real mass, const Start& start) {
  return add(make_elastic_field(mesh.vertices, mesh.tetrahedra, material), mesh.vertices,
             boundary_faces(mesh.tetrahedra), mass, start, false);
}

Body& SurfaceBodies::add_cloth(const TriangleSurface& sheet, Real stiffness, Real bending, Real mass,
                               const Start& start) {
  PotentialField field(sheet.vertices);
  field.add<Length>(edges_of(std::span<const Triangle>(sheet.triangles)), stiffness);
  field.add<BendingAngle>(hinges_of(sheet.triangles), bending);
  return add(std::move(field), sheet.vertices, sheet.triangles, mass, start, true);
}

Body& SurfaceBodies::add(PotentialField field, const Eigen::Matrix3Xd& vertices, std::vector<Triangle> triangles,
                         Real mass, const Start& start, bool touches_itself) {
  const auto count = static_cast<int>(vertices.cols());
  auto body = std::make_unique<Body>(make_body(std::move(field), std::vector<Real>(count, count / mass)));
  for (int i = 0; i < count; ++i) {
    body->set_position(i, start.rotation * vertices.col(i) + start.shift);
    body->set_velocity(i, start.velocity);
  }
  body->body.gravity = gravity;
  body->body.options.damping_time = damping_time;
  body->body.options.integrator = integrator;

  triangles_.push_back(triangles);
  std::vector<int> point_of(count, -1);
  std::vector<WeightedPoint> points;
  for (Triangle& triangle : triangles)
    for (int& corner : triangle) {
      if (point_of[corner] < 0) {
        point_of[corner] = static_cast<int>(points.size());
        points.push_back(WeightedPoint::at_particle(corner));
      }
      corner = point_of[corner];
    }
  surfaces_.push_back(std::make_unique<ContactSurface>(points, triangles, std::vector<Edge>{}, pack(vertices)));
  ContactSurface& surface = *surfaces_.back();
  surface.margin = margin;
  surface.friction = std::sqrt(friction);
  bodies_.push_back(std::move(body));
  const int last = static_cast<int>(bodies_.size()) - 1;
  for (int k = touches_itself ? last : last - 1; k >= 0; --k) {
    pairs_.push_back(std::make_unique<SurfacePair>(*surfaces_[k], surface));
    contacts_.push_back({pairs_.back().get(), k, last});
  }
  return *bodies_.back();
}

void SurfaceBodies::step(Real duration, int count) {
  for (int k = 0; k < count; ++k) {
    Island island;
    island.surfaces = contacts_;
    island.rigid_bodies.resize(1);  // does not move
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      Body& body = *bodies_[b];
      island.bodies.push_back(&body.body);
      for (const Real height : floors)
        for (int i = 0; i < body.particles().size(); ++i)
          if (body.position(i).y() - height < margin + reach * duration * (body.velocity(i).norm() + duration * 10))
            island.contacts.push_back({.a = Side::of_particles(static_cast<int>(b), WeightedPoint::at_particle(i)),
                                       .b = Side::of_rigid(0, {0, height + margin / 2, 0}),
                                       .friction = friction});
    }
    advance(island, duration);
  }
}

std::vector<Skin> SurfaceBodies::skins() const {
  std::vector<Skin> skins;
  skins.reserve(bodies_.size());
  for (std::size_t k = 0; k < bodies_.size(); ++k) skins.push_back({&bodies_[k]->particles().positions, triangles_[k]});
  return skins;
}

Momentum SurfaceBodies::momentum() const {
  Momentum sum{Vector3::Zero(), Vector3::Zero()};
  for (const auto& body : bodies_) {
    sum.linear += linear_momentum(body->particles());
    sum.angular += angular_momentum(body->particles());
  }
  return sum;
}

Real SurfaceBodies::kinetic_energy() const {
  Real sum = 0;
  for (const auto& body : bodies_) sum += penalty::kinetic_energy(body->particles());
  return sum;
}

Real SurfaceBodies::energy() const {
  Real sum = kinetic_energy();
  for (const auto& body : bodies_) {
    sum += body->field->energy(body->particles().positions);
    for (int i = 0; i < body->particles().size(); ++i)
      if (body->particles().inverse_masses[i] > 0)
        sum -= gravity.dot(body->position(i)) / body->particles().inverse_masses[i];
  }
  return sum;
}

}  // namespace penalty::testing
