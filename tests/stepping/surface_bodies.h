// Bodies with surfaces that may touch, stepped as one island, and what of them crosses: measured from positions alone.
#pragma once
#include <memory>

#include "contact/crossings.h"
#include "penalty/contact/surface_pair.h"
#include "penalty/mesh/triangle_surface.h"
#include "stepping/islands.h"

namespace penalty::testing {

/// How a body of `SurfaceBodies` starts.
struct Start {
  Vector3 shift = Vector3::Zero();     // of the rest shape [m]
  Vector3 velocity = Vector3::Zero();  // [m/s]
  Matrix3 rotation = Matrix3::Identity();
};

class SurfaceBodies {
 public:
  Real margin = 0.01;  // [m]
  Real friction = 0;
  Vector3 gravity = Vector3::Zero();
  Real damping_time = 0;
  Integrator integrator = Integrator::automatic;
  std::vector<Real> floors = {};  // heights of planes that look up [m]

  /// A body of tetrahedra with equal masses.
  Body& add(const TetMesh& mesh, Real stiffness, Real mass, const Start& start = {});
  Body& add(const TetMesh& mesh, const Material& material, Real mass, const Start& start = {});
  /// A cloth of springs and hinges, which touches itself.
  Body& add_cloth(const TriangleSurface& sheet, Real stiffness, Real bending, Real mass, const Start& start = {});

  void step(Real duration = 1.0 / 60, int count = 1);

  Body& operator[](std::size_t k) { return *bodies_[k]; }
  const ContactSurface& surface(std::size_t k) const { return *surfaces_[k]; }

  std::vector<Skin> skins() const;
  int crossings() const { return count_crossings(skins()); }
  Momentum momentum() const;
  Real energy() const;          // kinetic + elastic + in gravity [J]
  Real kinetic_energy() const;  // [J]
  int substeps() const { return bodies_.front()->body.report.substeps; }
  int retries() const { return bodies_.front()->body.report.retries; }

 private:
  Body& add(PotentialField field, const Eigen::Matrix3Xd& vertices, std::vector<Triangle> triangles, Real mass,
            const Start& start, bool touches_itself);

  std::vector<std::unique_ptr<Body>> bodies_;
  std::vector<std::vector<Triangle>> triangles_;  // over particles
  std::vector<std::unique_ptr<ContactSurface>> surfaces_;
  std::vector<std::unique_ptr<SurfacePair>> pairs_;
  std::vector<SurfaceContact> contacts_;
};

}  // namespace penalty::testing
