// Triangle meshes for Bullet, and what is measured on them.
#pragma once
#include "bullet/simulation.h"

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>

#include <array>
#include <functional>
#include <memory>
#include <vector>

namespace penalty::testing {

struct MeshData {
  std::vector<Vector3> vertices;
  std::vector<std::array<int, 3>> triangles;  // counter-clockwise seen from the side that they face

  MeshData turned() const;  // facing the other way
  MeshData shifted(const Vector3& shift) const;
  MeshData with(const MeshData& other) const;
};

MeshData box_mesh(const Vector3& half_extents);  // facing outwards

/// Of so many cells each way, in the plane y = 0 about the origin, facing up.
MeshData sheet_mesh(Real half_x, Real half_z, int cells = 1);

/// The points (x, y) of the line at z = -half_z and z = half_z, joined; facing up where x grows.
MeshData extruded_mesh(const std::vector<std::array<Real, 2>>& line, Real half_z);

/// A soft body of this margin, at rest `shift` from where its mesh is.
JellyOptions jelly_with(Real margin, const Vector3& shift, Real damping_time = 0.01);

/// The least of what `height` says of its nodes.
Real least(const btSoftBody& body, const std::function<Real(const Vector3&)>& height);

/// A static mesh that owns its triangles.
class MeshShape final : private std::unique_ptr<btTriangleMesh>, public btBvhTriangleMeshShape {
 public:
  MeshShape(const MeshData& data, Real margin);
  BT_DECLARE_ALIGNED_ALLOCATOR();
};

}  // namespace penalty::testing
