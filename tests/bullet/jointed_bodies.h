// A world with joints, and where they hold.
#pragma once
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "bullet/simulation.h"

namespace penalty::testing {

/// Rigid bodies, held by joints, and pads of jelly that they touch.
class RigidJoints : public WorldTest {
 protected:
  template <class Joint>
  static void leave_free_along_y(Joint& joint) {
    joint.setLinearLowerLimit({0, 1, 0});  // above the upper one: no limit
    joint.setLinearUpperLimit({0, -1, 0});
    joint.setAngularLowerLimit({0, 0, 0});
    joint.setAngularUpperLimit({0, 0, 0});
  }
  static btVector3 along_z() { return {0, 0, 1}; }

  static btTransform at_point(const Vector3& point) {
    btTransform transform;
    transform.setIdentity();
    transform.setOrigin(to_bullet(point));
    return transform;
  }
  static Vector3 on(const btRigidBody& body, const Vector3& local) {
    return to_vector(body.getWorldTransform() * to_bullet(local));
  }
  static Vector3 center(const btRigidBody& body) { return on(body, Vector3::Zero()); }

  ~RigidJoints() override {
    for (const auto& joint : joints_) sim.world().removeConstraint(joint.get());
  }
  void SetUp() override { sim.set_gravity({0, -g, 0}); }

  template <class Joint, class... Args>
  Joint& add(Args&&... args) {
    auto joint = std::make_unique<Joint>(std::forward<Args>(args)...);
    Joint& added = *joint;
    sim.world().addConstraint(joint.get(), true);
    joints_.push_back(std::move(joint));
    return added;
  }
  void remove(const btTypedConstraint& joint) {
    const auto found = std::find_if(joints_.begin(), joints_.end(), [&](const auto& j) { return j.get() == &joint; });
    sim.world().removeConstraint(found->get());
    joints_.erase(found);
  }
  btSoftBody& add_pad(const Vector3& size = {1, 0.6, 1}, const std::array<int, 3>& cells = {8, 4, 8}) {
    return sim.add_jelly(make_box(size, cells), {.shift = {0, 0.021, 0}, .attach = {.step = {.damping_time = 0.02}}});
  }

  std::vector<std::unique_ptr<btTypedConstraint>> joints_;
};

}  // namespace penalty::testing
