// What the user may choose about a scene.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "penalty/energy/material.h"
#include "penalty/math/types.h"
#include "penalty/stepping/step_options.h"

namespace penalty::demo {

enum class WorldKind { classic, deformable };

/// How a body starts; its rest shape stays what it is. `squash` leaves a fifth of the height, `plane`, `line` and
/// `point` nothing of one, two and three directions, `mirror` turns every tetrahedron inside-out, `scramble` puts each
/// vertex anywhere in the bounding box, `jitter` moves it by up to half the mean distance of neighbours.
enum class Start { rest, squash, plane, line, point, mirror, scramble, jitter };

/// Throw std::invalid_argument that names the choices.
WorldKind world_from_name(std::string_view name);
Start start_from_name(std::string_view name);
ElasticModel model_from_name(std::string_view name);
std::string_view name_of(WorldKind world);
std::string_view name_of(Start start);
std::span<const Start> all_starts();
std::optional<Integrator> integrator_from_name(std::string_view name);  // empty: "auto"

/// Whatever is empty is left to the scene.
struct SceneOptions {
  std::string mesh{};               // a file, or "torus", "ball", "box", "bunny"
  bool scale = true;                // to 2 m along the longest side
  std::optional<int> cells{};       // along the longest side
  std::optional<Real> stiffness{};  // K of every constraint [J], with a mass of 1 kg
  std::optional<Real> young{};      // [Pa], with the mass that follows from the density
  std::optional<Real> poisson{};
  std::optional<ElasticModel> model{};  // of bodies made of tetrahedra
  std::optional<int> phases{};          // 2: tetrahedra give way far from rest, see make_recovering_field
  std::optional<Real> damping{};        // ratio of damping to stiffness [s]
  std::optional<Real> drag{};           // [1/s]
  std::optional<int> substeps{};        // in a step; empty: from the stability limit
  std::optional<Integrator> integrator{};
  std::optional<int> order{};  // of implicit steps
  std::optional<int> spheres{};
  std::optional<Start> start{};
  std::uint32_t seed = 1;
};

}  // namespace penalty::demo
