// Meshes of rigid shapes, shared by all bodies of a kind, and what differs from body to body.
#pragma once
#include <cstdint>
#include <vector>

#include "render/picture.h"
#include "render/surface_mesh.h"

namespace penalty::render {

/// A point of the body is core * half extents + direction * radius: one formula that lets a capsule keep its round
/// ends and a box its corners, whatever their size.
struct RigidVertex {
  float core[3];
  float direction[3];
  float normal[3];
};

struct RigidMesh {
  std::vector<RigidVertex> vertices;
  std::vector<std::uint32_t> indices;
};

/// In the order of the alternatives of Shape.
RigidMesh rigid_mesh(std::size_t shape);

/// A sphere of few triangles: there may be hundreds of markers, each a few pixels wide.
RigidMesh marker_mesh();

struct RigidInstance {
  float rows[3][4];  // rotation and position, in unit space
  float size[4];     // half extents, radius
  float color[4];    // linear light; the fourth is 1 for two-tone
};

/// Throws std::invalid_argument for a size that is not positive.
RigidInstance rigid_instance(const RigidBody& body, const UnitSpace& space);

}  // namespace penalty::render
