// Corners and edges of rigid bodies, and the soft surfaces that they may touch between the nodes.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "penalty/contact/surface_pair.h"
#include "shape_edges.h"

class btCollisionObject;

namespace penalty {

struct HeldBody;

/// Kept from step to step while they are asked for.
class RigidSurfaces {
 public:
  void begin_step();

  /// Pairs of the surface of the body with the corners and edges of the object that come into `box`, which holds all that
  /// the body may reach in the step.
  std::vector<SurfacePair*> near(HeldBody& held, const btCollisionObject& object, const Box& box);

 private:
  struct Object {
    std::vector<Real> fingerprint = {};
    Box covered = {};  // in the frame of the object, that of a concave one has been searched
    std::vector<ShapeEdges> edges = {};
    std::vector<std::shared_ptr<ContactSurface>> surfaces = {};
    Real margin = 0;  // least of the soft bodies that are near in this step [m]
    int used = 0;
  };
  struct Pair {
    std::shared_ptr<ContactSurface> soft, rigid;  // of these it was made
    std::unique_ptr<SurfacePair> pair;
    int used = 0;
  };

  Object& refreshed(const HeldBody& held, const btCollisionObject& object, const Box& box);

  // By the order of the body that sees a part of it, of one of triangles, and the unique id of their broadphase proxies.
  std::map<std::pair<std::uint64_t, int>, Object> objects_;
  std::map<std::array<std::uint64_t, 3>, Pair>
      pairs_;  // by the order of the body, the object, and which of its surfaces
  int step_ = 0;
};

}  // namespace penalty
