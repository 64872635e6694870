#include "main/summary.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "main/readable.h"

namespace penalty::demo {
namespace {

using Json = nlohmann::ordered_json;

Json number(Real value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
Json number(const std::optional<Real>& value) { return value ? number(*value) : Json(nullptr); }

template <class Get>
std::vector<Real> column(const std::vector<StepRecord>& steps, Get get) {
  std::vector<Real> values;
  values.reserve(steps.size());
  for (const StepRecord& step : steps) values.push_back(static_cast<Real>(get(step)));
  return values;
}

Real largest(const std::vector<Real>& values) { return *std::max_element(values.begin(), values.end()); }

Real mean(const std::vector<Real>& values) {
  Real sum = 0;
  for (Real value : values) sum += value;
  return sum / static_cast<Real>(values.size());
}

Real median(std::vector<Real> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Json energy_summary(const std::vector<Real>& energies) {
  return {{"initial", number(energies.front())},
          {"peak", number(largest(energies))},
          {"least", number(*std::min_element(energies.begin(), energies.end()))},
          {"final", number(energies.back())}};
}

/// Of all bodies together; the source, and what was amiss with it, is that of the first.
Json mesh_summary(const std::vector<SoftObject>& bodies) {
  Eigen::Index vertices = 0;
  std::size_t tetrahedra = 0, triangles = 0, edges = 0;
  for (const SoftObject& body : bodies) {
    vertices += body.mesh.vertices().cols();
    tetrahedra += body.mesh.tetrahedra().size();
    triangles += body.mesh.drawn_triangles().size();
    edges += body.mesh.edges().size();
  }
  const BodyMesh& first = bodies.front().mesh;
  return {{"source", first.source()}, {"repairs", first.repairs()}, {"vertices", vertices},
          {"tetrahedra", tetrahedra}, {"triangles", triangles},     {"edges", edges}};
}

/// What each batch holds at the end, and what came and went in the course of the run.
Json ledger_summary(const std::vector<StepRecord>& steps) {
  Json batches = Json::array(), flows;
  for (const LedgerEntry& b : steps.back().batches)
    batches.push_back({{"name", b.name},
                       {"elements", b.num_elements},
                       {"enabled", b.num_enabled},
                       {"energy", number(b.energy)},
                       {"strain", {{"mean", number(b.mean_strain)}, {"max", number(b.largest_strain)}}}});
  for (const EnergyFlows::Part& flow : EnergyFlows::parts())
    flows[std::string(flow.name)] = number(steps.back().flows.*flow.member);
  return {{"batches", batches}, {"flows", flows}, {"residual", number(ledger_residual(steps))}};
}

/// The first moment from which on the soft bodies keep less than a hundredth of their largest kinetic energy.
std::optional<Real> settling_time(const std::vector<StepRecord>& steps) {
  const Real limit = 0.01 * largest(column(steps, [](const auto& s) { return s.energies.kinetic; }));
  auto first = steps.end();
  while (first != steps.begin() && std::prev(first)->energies.kinetic < limit) --first;
  if (first == steps.end() || first == steps.begin()) return {};
  return first->time;
}

/// Mean of the tip's drop between 1 and 2 s: of its values at 16/15, 17/15, ... 30/15 s, which is how the reference
/// figures 0.2720 m (16 cells) and 0.3518 m (32 cells) were taken; the beam swings about once a second, so that samples
/// matter. Null for a shorter run.
std::optional<Real> mean_tip_drop(const std::vector<StepRecord>& steps) {
  Real sum = 0;
  std::size_t after = 1;
  for (int sample = 16; sample <= 30; ++sample) {
    const Real time = sample / 15.0;
    while (after < steps.size() && steps[after].time < time - 1e-9) ++after;
    if (after >= steps.size()) return {};
    const StepRecord &a = steps[after - 1], &b = steps[after];
    const Real share = std::min((time - a.time) / (b.time - a.time), 1.0);
    const Real before = a.tip_drop.value_or(0), now = b.tip_drop.value_or(0);
    sum += before + share * (now - before);
  }
  return sum / 15;
}

/// Of the steps that were taken: "explicit", "implicit", or "mixed".
std::string integrator_used(const std::vector<StepRecord>& taken) {
  const auto implicit = std::count_if(taken.begin(), taken.end(), [](const StepRecord& step) { return step.implicit; });
  if (implicit == 0) return "explicit";
  return implicit == static_cast<std::ptrdiff_t>(taken.size()) ? "implicit" : "mixed";
}

}  // namespace

Json summarize(const Recording& recording, const RunOptions& options, const SceneSetup& setup) {
  const std::vector<StepRecord>& steps = recording.steps;
  const std::vector<StepRecord> taken(steps.begin() + 1, steps.end());
  const auto over_steps = [&taken](auto get) { return taken.empty() ? std::vector<Real>{0} : column(taken, get); };
  const std::vector<Real> total = column(steps, [](const auto& s) { return s.energies.total(); });
  const std::vector<Real> milliseconds = over_steps([](const auto& s) { return s.milliseconds; });
  const std::vector<Real> substeps = over_steps([](const auto& s) { return s.substeps; });
  const std::vector<Real> newton_iterations = over_steps([](const auto& s) { return s.newton_iterations; });
  const StepRecord& last = steps.back();
  Real gain = 0;
  for (std::size_t i = 1; i < total.size(); ++i) gain = std::max(gain, total[i] - total[i - 1]);
  long retries = 0;
  for (const StepRecord& step : steps) retries += step.retries;

  Json json;
  json["scene"] = options.scene;
  json["world"] = name_of(options.world);
  json["integrator"] = integrator_used(taken);
  json["precision"] = bullet_precision();
  json["mesh"] = mesh_summary(setup.bodies);
  json["start"] = options.scene_options.start ? Json(name_of(*options.scene_options.start)) : Json(nullptr);
  json["seed"] = recording.seed;
  json["dt"] = 1 / options.rate;
  json["steps"] = taken.size();
  json["ms_per_step"] = {{"median", number(median(milliseconds))}, {"max", number(largest(milliseconds))}};
  json["substeps"] = {{"mean", number(mean(substeps))}, {"max", number(largest(substeps))}};
  json["newton_iterations"] = {{"mean", number(mean(newton_iterations))}, {"max", number(largest(newton_iterations))}};
  json["retries"] = retries;
  json["energy"] = energy_summary(total);
  json["elastic_energy"] = energy_summary(column(steps, [](const auto& s) { return s.energies.elastic; }));
  json["largest_energy_gain"] = number(gain);
  json["settling_time"] = number(settling_time(steps));
  json["rest_error"] = number(recording.rest_error);
  json["length_error"] = {{"mean", number(last.errors.length_mean)}, {"max", number(last.errors.length_max)}};
  json["volume_error"] = {{"mean", number(last.errors.volume_mean)}, {"max", number(last.errors.volume_max)}};
  json["volume_error_peak_mean"] = number(largest(column(steps, [](const auto& s) { return s.errors.volume_mean; })));
  json["inverted"] = last.errors.inverted;
  json["inverted_peak"] = static_cast<long>(largest(column(steps, [](const auto& s) { return s.errors.inverted; })));
  json["penetration"] = number(largest(column(steps, [](const auto& s) { return s.penetration; })));
  json["contact_depth"] = number(largest(column(steps, [](const auto& s) { return s.contact_depth; })));
  json["momentum"] = {{"linear", number(recording.linear_drift)}, {"angular", number(recording.angular_drift)}};
  json["ledger"] = ledger_summary(steps);
  for (const Fact& fact : recording.facts) json[fact.name] = number(fact.value);
  if (last.tip_drop) json["tip_drop"] = number(mean_tip_drop(steps));
  json["finite"] = recording.finite;
  json["recovered"] = recording.recovered();
  if (!recording.finite) json["failure"] = recording.failure;
  return json;
}

Json summarize(const std::vector<Figure>& figures, const RunOptions& options) {
  Json json;
  json["scene"] = options.scene;
  for (const char* key : {"world", "integrator"}) json[key] = nullptr;
  json["precision"] = bullet_precision();
  json["mesh"] = {{"source", nullptr}, {"repairs", ""},  {"vertices", 0},
                  {"tetrahedra", 0},   {"triangles", 0}, {"edges", 0}};
  json["seed"] = options.scene_options.seed;
  json["dt"] = nullptr;
  json["steps"] = 0;
  bool finite = true;
  for (const Figure& figure : figures)
    for (const Fact& fact : figure.facts) {
      json[fact.name] = number(fact.value);
      finite = finite && std::isfinite(fact.value);
    }
  for (const char* key :
       {"ms_per_step", "energy", "rest_error", "length_error", "volume_error", "inverted", "momentum", "ledger"})
    json[key] = nullptr;
  json["finite"] = finite;
  json["recovered"] = nullptr;
  return json;
}

std::string describe(const std::vector<Figure>& figures) {
  std::ostringstream text;
  for (const Figure& figure : figures) {
    text << figure.name << '\n';
    for (const Fact& fact : figure.facts) text << "  " << fact.name << ": " << readable(fact.value) << '\n';
  }
  return text.str();
}

std::string describe(const Json& summary, const std::vector<Fact>& facts) {
  const auto shown = [](const Json& number) { return number.is_null() ? "not finite" : readable(number.get<Real>()); };
  std::ostringstream text;
  const Json& mesh = summary["mesh"];
  const char* const elements = mesh["tetrahedra"] > 0 ? "tetrahedra" : "triangles";
  text << summary["scene"].get<std::string>() << ", " << summary["world"].get<std::string>() << " world, "
       << summary["precision"].get<std::string>() << ": " << mesh[elements] << ' ' << elements << " of "
       << mesh["source"].get<std::string>() << '\n';
  if (const std::string repairs = mesh["repairs"].get<std::string>(); !repairs.empty())
    text << "  in the file: " << repairs << '\n';
  text << "  " << summary["steps"] << " steps, " << shown(summary["ms_per_step"]["median"]) << " ms each, "
       << shown(summary["substeps"]["mean"]) << " substeps, " << summary["retries"] << " retries\n"
       << "  energy [J]: " << shown(summary["energy"]["initial"]) << " at first, " << shown(summary["energy"]["final"])
       << " at the end, largest gain in a step " << shown(summary["largest_energy_gain"]) << '\n'
       << "  at the end: rest error " << shown(summary["rest_error"]);
  if (mesh["tetrahedra"] > 0)
    text << ", volume error " << shown(summary["volume_error"]["mean"]) << " in the mean, " << summary["inverted"]
         << " inverted\n";
  else
    text << ", length error " << shown(summary["length_error"]["mean"]) << " in the mean\n";
  if (!summary["momentum"]["linear"].is_null())
    text << "  momentum drift: linear " << shown(summary["momentum"]["linear"]) << ", angular "
         << shown(summary["momentum"]["angular"]) << '\n';
  text << "  energy ledger: " << shown(summary["ledger"]["residual"]) << " of the largest energy unexplained\n";
  if (summary.contains("tip_drop"))
    text << "  tip drop [m]: "
         << (summary["tip_drop"].is_null() ? "measured between 1 and 2 s" : shown(summary["tip_drop"])) << '\n';
  for (const Fact& fact : facts) text << "  " << fact.name << ": " << readable(fact.value) << '\n';
  if (summary.contains("runs"))
    text << "  " << summary["recovered_runs"] << " of " << summary["runs"] << " runs recovered\n";
  return text.str();
}

}  // namespace penalty::demo
