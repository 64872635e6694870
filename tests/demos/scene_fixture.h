// What the tests of scenes share.
#pragma once
#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>

#include "scenes/scene.h"
#include "scenes/shape_measure.h"

namespace penalty::demo {

class Scenes : public testing::TestWithParam<WorldKind> {
 protected:
  std::unique_ptr<Scene> make(std::string_view name, const SceneOptions& options) const {
    const SceneEntry& entry = find_scene(name);
    return std::make_unique<Scene>(entry.setup(options, entry.body(options)), GetParam());
  }
  static constexpr Real dt = 1.0 / 64;
  static constexpr Real margin = 0.02;  // of the soft body: contact begins so far from the rigid surfaces [m]
};

inline std::string world_name(const testing::TestParamInfo<WorldKind>& info) {
  return std::string(name_of(info.param));
}

/// The fact of this name at the present state; throws if the scene has none.
inline Real fact(const Scene& scene, std::string_view name) {
  for (const Fact& fact : scene.facts())
    if (fact.name == name) return fact.value;
  throw std::out_of_range("no fact " + std::string(name));
}

inline Real soft_energy(const Scene& scene) { return scene.energies().elastic + scene.energies().kinetic; }

}  // namespace penalty::demo
