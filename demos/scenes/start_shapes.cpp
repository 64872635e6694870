#include "scenes/start_shapes.h"

#include <array>
#include <cmath>
#include <random>
#include <stdexcept>
#include <utility>

namespace penalty::demo {
namespace {

constexpr std::array<std::pair<std::string_view, Start>, 8> starts{{{"rest", Start::rest},
                                                                    {"squash", Start::squash},
                                                                    {"plane", Start::plane},
                                                                    {"line", Start::line},
                                                                    {"point", Start::point},
                                                                    {"mirror", Start::mirror},
                                                                    {"scramble", Start::scramble},
                                                                    {"jitter", Start::jitter}}};
constexpr std::array<std::pair<std::string_view, WorldKind>, 2> worlds{
    {{"classic", WorldKind::classic}, {"deformable", WorldKind::deformable}}};

constexpr std::array<std::pair<std::string_view, ElasticModel>, 3> models{
    {{"springs", ElasticModel::springs_volumes},
     {"springs+areas", ElasticModel::springs_areas_volumes},
     {"neo-hookean", ElasticModel::neo_hookean}}};

constexpr std::array<std::pair<std::string_view, std::optional<Integrator>>, 3> integrators{
    {{"auto", std::nullopt}, {"explicit", Integrator::explicit_step}, {"implicit", Integrator::implicit_step}}};

template <class Table>
auto look_up(const Table& table, std::string_view what, std::string_view name) {
  std::string choices;
  for (const auto& [key, value] : table) {
    if (key == name) return value;
    choices += (choices.empty() ? "" : ", ") + std::string(key);
  }
  throw std::invalid_argument("unknown " + std::string(what) + " \"" + std::string(name) + "\", must be one of " +
                              choices);
}

template <class Table, class Value>
std::string_view name_in(const Table& table, Value value) {
  for (const auto& [key, entry] : table)
    if (entry == value) return key;
  return {};
}

}  // namespace

WorldKind world_from_name(std::string_view name) { return look_up(worlds, "world", name); }
Start start_from_name(std::string_view name) { return look_up(starts, "start", name); }
ElasticModel model_from_name(std::string_view name) { return look_up(models, "model", name); }
std::optional<Integrator> integrator_from_name(std::string_view name) {
  return look_up(integrators, "integrator", name);
}
std::string_view name_of(WorldKind world) { return name_in(worlds, world); }
std::string_view name_of(Start start) { return name_in(starts, start); }

std::span<const Start> all_starts() {
  static const auto list = [] {
    std::array<Start, starts.size()> values;
    for (std::size_t k = 0; k < starts.size(); ++k) values[k] = starts[k].second;
    return values;
  }();
  return list;
}

Eigen::Matrix3Xd start_positions(const Eigen::Matrix3Xd& rest, Start start, std::uint32_t seed) {
  const Vector3 low = rest.rowwise().minCoeff(), high = rest.rowwise().maxCoeff(), middle = (low + high) / 2;
  const auto scaled = [&](Real x, Real y, Real z) -> Eigen::Matrix3Xd {
    return (Vector3(x, y, z).asDiagonal() * (rest.colwise() - middle)).colwise() + middle;
  };
  switch (start) {
    case Start::rest:
      return rest;
    case Start::squash:
      return scaled(1, 0.2, 1);
    case Start::plane:
      return scaled(1, 0, 1);
    case Start::line:
      return scaled(1, 0, 0);
    case Start::point:
      return scaled(0, 0, 0);
    case Start::mirror:
      return scaled(-1, 1, 1);
    case Start::scramble:
    case Start::jitter:
      break;
  }
  // Not std::uniform_real_distribution, which every library fills in its own way: the same seed is the same start.
  std::mt19937_64 random(seed);
  Eigen::Matrix3Xd x(3, rest.cols());
  for (Real& coordinate : x.reshaped()) coordinate = static_cast<Real>(random() >> 11) * 0x1p-53;
  if (start == Start::scramble) return ((high - low).asDiagonal() * x).colwise() + low;
  const Real spacing = (high - low).norm() / std::cbrt(static_cast<Real>(rest.cols()));
  return rest + spacing * (x.array() - 0.5).matrix();
}

}  // namespace penalty::demo
