// Joints between rigid bodies, as rows of velocity constraints.
#pragma once
#include <array>
#include <limits>
#include <span>
#include <vector>

#include "penalty/stepping/rigid_body.h"

namespace penalty {

/// One line of what a joint asks, where its bodies are now: of the velocities v and angular velocities w of bodies a and b
///
///     u = linear_a . v_a + angular_a . w_a + linear_b . v_b + angular_b . w_b
///
/// is to be `wanted + recovery - softness * impulse`, by an impulse between `least` and `most`, which gives the bodies
/// linear_a and linear_b times itself, and the moments angular_a and angular_b. Lines of turning have no linear part; u is
/// in m/s, or in rad/s.
struct JointRow {
  static constexpr Real unlimited = std::numeric_limits<Real>::infinity();

  int joint = 0, number = 0;  // of the island, and of the row in its joint
  Vector3 linear_a = Vector3::Zero(), angular_a = Vector3::Zero();
  Vector3 linear_b = Vector3::Zero(), angular_b = Vector3::Zero();
  Real wanted = 0;
  Real recovery = 0;  // what takes an error of position back in the next drift
  Real softness = 0;  // [1/kg], or [1/(kg m²)]
  Real least = -unlimited, most = unlimited;

  bool is_two_sided() const { return least == -unlimited && most == unlimited; }
  bool is_force() const { return least == most; }  // given in full, whatever the velocities are
};

/// A joint of an island. Body -1 is the world, which moves nowhere.
struct Joint {
  static constexpr int most_rows = 24;

  int a = -1, b = -1;                       // indices into the rigid bodies of the island
  Real strength = JointRow::unlimited;      // it breaks when a row has to give as much as this in a step [N s]
  int num_rows = 0;                         // in the last substep, be it of the last step;
  std::array<Real, most_rows> forces = {};  // what these gave: where the next one starts from [N], [N m]

  // In the step.
  bool asks = false;  // it had rows
  bool is_broken = false;
  std::array<Real, most_rows> given = {};  // by each row [N s], [N m s]
  Vector3 impulse_a = Vector3::Zero(), moment_a = Vector3::Zero();
  Vector3 impulse_b = Vector3::Zero(), moment_b = Vector3::Zero();
};

/// Knows the joints of an island.
class JointSource {
 public:
  virtual ~JointSource() = default;

  /// Appends what the joints ask of the bodies where these are now, before a drift of `h` [s] and after forces have acted
  /// for `since` [s]: joint by joint, the rows of each numbered from zero, no more than Joint::most_rows of them.
  virtual void add_rows(std::span<const RigidBody> bodies, Real h, Real since, std::vector<JointRow>& rows) = 0;
};

}  // namespace penalty
