// How fast everything moves, from where it was.
#pragma once
#include <algorithm>
#include <deque>

#include "scenes/scene_state.h"

namespace penalty::demo {

class MotionWatch {
 public:
  void see(const SceneState& state) {
    Moment now{state.time, {}, state.objects};
    for (const SoftState& body : state.bodies) now.x.push_back(body.particles.positions);
    moments_.push_back(std::move(now));
    while (moments_.back().time - moments_.front().time > longest) moments_.pop_front();
  }

  /// The largest of a vertex, or of the middle of a rigid object [m/s]: over the last step that was seen, and over the last
  /// half second.
  Real speed() const { return moments_.size() < 2 ? 0 : speed_from(moments_[moments_.size() - 2]); }
  Real mean_speed() const { return moments_.size() < 2 ? 0 : speed_from(moments_.front()); }

 private:
  static constexpr Real longest = 0.5 + 1e-6;  // [s]
  struct Moment {
    Real time;
    std::vector<PackedVectors> x;
    std::vector<Pose> objects;
  };

  Real speed_from(const Moment& then) const {
    const Moment& now = moments_.back();
    Real way = 0;
    for (std::size_t b = 0; b < now.x.size(); ++b)
      way = std::max(way, (now.x[b] - then.x[b]).colwise().norm().maxCoeff());
    for (std::size_t k = 0; k < now.objects.size(); ++k)
      way = std::max(way, (now.objects[k].position - then.objects[k].position).norm());
    return way / (now.time - then.time);
  }

  std::deque<Moment> moments_;
};

}  // namespace penalty::demo
