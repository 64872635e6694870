#include "study/stability.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>

#include "penalty/fields/elastic_field.h"
#include "penalty/kinds/kinds.h"
#include "penalty/mesh/builders.h"
#include "penalty/stepping/island.h"

namespace penalty::study {
namespace {

constexpr Real round_off = 1e-12;  // of the energy at the start
constexpr std::array<Real, 3> rates{30, 60, 240};
constexpr Real chain_rate = 60;

SteppedBody make_body(PotentialField& field, std::vector<Real> inverse_masses) {
  SteppedBody body;
  const PackedVectors& rest = field.rest_positions();
  body.particles = {rest, PackedVectors::Zero(4, rest.cols()), std::move(inverse_masses)};
  body.field = &field;
  body.options.integrator = Integrator::implicit_step;
  estimate_stability(body);
  return body;
}

void step(SteppedBody& body, Real duration) {
  Island island{.bodies = {&body}};
  advance(island, duration);
}

Real relative(const Vector3& change, const Vector3& start) { return change.norm() / start.norm(); }

}  // namespace

bool FlightResult::is_stable() const { return finite && largest_energy <= 1 + round_off; }

FlightResult fly(Real stiffness, Real rate, Real duration) {
  const TetMesh mesh = make_box({1, 1, 1}, {4, 4, 4});
  PotentialField field = make_elastic_field(mesh.vertices, mesh.tetrahedra, stiffness);
  const auto count = static_cast<std::size_t>(mesh.vertices.cols());
  SteppedBody cube = make_body(field, std::vector<Real>(count, static_cast<Real>(count)));
  Particles& p = cube.particles;
  p.positions.row(0) *= 1.6;
  const Vector3 drift(0.3, -0.2, 0.1), spin(0.5, 1, -0.7);  // [m/s], [rad/s]
  for (int i = 0; i < p.size(); ++i)
    p.velocities.col(i).head<3>() = drift + spin.cross(Vector3(p.positions.col(i).head<3>()));
  cube.positions_changed();

  FlightResult result{.stiffness = stiffness, .rate = rate};
  const Vector3 linear = linear_momentum(p), angular = angular_momentum(p);
  const Real start = field.energy(p.positions) + kinetic_energy(p);
  const auto steps = std::max<long>(1, std::lround(duration * rate));
  for (long k = 0; k < steps; ++k) {
    step(cube, 1 / rate);
    const Real energy = field.energy(p.positions) + kinetic_energy(p);
    result.finite = result.finite && cube.report.finite && std::isfinite(energy);
    result.end_energy = energy / start;
    result.largest_energy = std::max(result.largest_energy, result.end_energy);
    result.newton_iterations += static_cast<Real>(cube.report.newton_iterations) / static_cast<Real>(steps);
    result.linear_iterations += static_cast<Real>(cube.report.linear_iterations) / static_cast<Real>(steps);
  }
  result.linear_drift = relative(linear_momentum(p) - linear, linear);
  result.angular_drift = relative(angular_momentum(p) - angular, angular);
  return result;
}

ChainResult hang(Real stiffness, Real duration) {
  constexpr int nodes = 21;
  constexpr Real spacing = 0.1, node_mass = 0.002, weight = 5, noise = 1e-4;  // [m], [kg], [kg], [m]
  Eigen::Matrix3Xd rest = Eigen::Matrix3Xd::Zero(3, nodes);
  std::vector<Edge> edges;
  for (int i = 0; i < nodes; ++i) rest(1, i) = -spacing * i;
  for (int i = 0; i + 1 < nodes; ++i) edges.push_back({i, i + 1});
  PotentialField field(rest);
  field.add<Length>(edges, stiffness);
  std::vector<Real> inverse_masses(nodes, 1 / node_mass);
  inverse_masses.front() = 0;
  inverse_masses.back() = 1 / weight;
  SteppedBody chain = make_body(field, std::move(inverse_masses));
  chain.gravity = Vector3(0, -9.81, 0);
  std::mt19937_64 random(1);
  const auto aside = [&] { return noise * (static_cast<Real>(random() >> 11) * 0x1p-52 - 1); };
  for (int i = 1; i < nodes; ++i)
    for (const int axis : {0, 2}) chain.particles.positions(axis, i) += aside();
  chain.positions_changed();

  ChainResult result{.stiffness = stiffness};
  const auto steps = std::max<long>(1, std::lround(duration * chain_rate));
  for (long k = 0; k < steps; ++k) {
    step(chain, 1 / chain_rate);
    const PackedVectors& x = chain.particles.positions;
    result.finite = result.finite && chain.report.finite && x.allFinite();
    for (int i = 0; i < nodes; ++i) result.farthest = std::max(result.farthest, std::hypot(x(0, i), x(2, i)));
  }
  return result;
}

bool StabilityTable::is_stable() const {
  return std::all_of(flights.begin(), flights.end(), [](const FlightResult& f) { return f.is_stable(); }) &&
         std::all_of(chains.begin(), chains.end(), [](const ChainResult& c) { return c.finite; });
}

StabilityTable measure_stability(Real flight, Real chain, const std::function<void(Real)>& progress) {
  constexpr int lowest = -2, highest = 8, lowest_of_chain = 2, highest_of_chain = 6;  // powers of ten [J]
  Real done = 0, total = 0;                                                           // in steps a second
  for (const Real rate : rates) total += (highest - lowest + 1) * rate;
  StabilityTable table;
  for (int power = lowest; power <= highest; ++power)
    for (const Real rate : rates) {
      table.flights.push_back(fly(std::pow(10.0, power), rate, flight));
      progress((done += rate) / total);
    }
  for (int power = lowest_of_chain; power <= highest_of_chain; ++power)
    table.chains.push_back(hang(std::pow(10.0, power), chain));
  return table;
}

std::string StabilityTable::text() const {
  std::string text =
      "A stretched cube of 320 tetrahedra and 1 kg in free flight, implicit steps\n"
      "     K [J]  rate [Hz]  max E/E0 - 1   end E/E0  dp/p     dL/L     Newton/step  CG/step  finite\n";
  std::array<char, 160> line{};
  for (const FlightResult& f : flights) {
    std::snprintf(line.data(), line.size(), "%10.0e  %9.0f  %12.1e  %9.3e  %7.1e  %7.1e  %11.3g  %7.3g  %s\n",
                  f.stiffness, f.rate, f.largest_energy - 1, f.end_energy, f.linear_drift, f.angular_drift,
                  f.newton_iterations, f.linear_iterations, f.finite ? "yes" : "NO");
    text += line.data();
  }
  text +=
      "\nA hanging chain of 21 nodes, 5 kg below 2 g each, implicit steps at 60 Hz\n"
      "     K [J]  farthest from the axis [m]  finite\n";
  for (const ChainResult& c : chains) {
    std::snprintf(line.data(), line.size(), "%10.0e  %26.3e  %s\n", c.stiffness, c.farthest, c.finite ? "yes" : "NO");
    text += line.data();
  }
  return text;
}

}  // namespace penalty::study
