#include "main/outputs.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>

#include "main/usage_error.h"
#include "render/plot.h"

namespace penalty::demo {
namespace {

/// Names of batches as they head a column: without white space, and none twice.
std::vector<std::string> column_names(const std::vector<LedgerEntry>& batches) {
  std::vector<std::string> names;
  for (const LedgerEntry& batch : batches) {
    std::string name = batch.name;
    for (char& c : name)
      if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
    const std::string plain = name;
    for (int k = 2; std::find(names.begin(), names.end(), name) != names.end(); ++k) name = plain + std::to_string(k);
    names.push_back(name);
  }
  return names;
}

}  // namespace

void write_csv(const std::filesystem::path& path, const std::vector<StepRecord>& steps) {
  std::ofstream file(path);
  file.precision(10);
  file << "time,elastic,kinetic,rigid_kinetic,gravitational,total,length_error_mean,length_error_max,volume_error_mean,"
          "volume_error_max,inverted,penetration,contact_depth,substeps,retries,milliseconds,tip_drop";
  for (const EnergyFlows::Part& flow : EnergyFlows::parts()) file << ',' << flow.name;
  if (!steps.empty())
    for (const std::string& name : column_names(steps.front().batches))
      file << ',' << name << "_energy," << name << "_strain_mean," << name << "_strain_max";
  file << '\n';
  for (const StepRecord& s : steps) {
    const Energies& e = s.energies;
    file << s.time << ',' << e.elastic << ',' << e.kinetic << ',' << e.rigid_kinetic << ',' << e.gravitational << ','
         << e.total() << ',' << s.errors.length_mean << ',' << s.errors.length_max << ',' << s.errors.volume_mean << ','
         << s.errors.volume_max << ',' << s.errors.inverted << ',' << s.penetration << ',' << s.contact_depth << ','
         << s.substeps << ',' << s.retries << ',' << s.milliseconds << ',' << s.tip_drop.value_or(0);
    for (const EnergyFlows::Part& flow : EnergyFlows::parts()) file << ',' << s.flows.*flow.member;
    for (const LedgerEntry& b : s.batches) file << ',' << b.energy << ',' << b.mean_strain << ',' << b.largest_strain;
    file << '\n';
  }
  file.close();
  if (!file) throw UsageError(path.string() + ": cannot be written");
}

void write_energy_plot(const std::filesystem::path& path, const std::string& title,
                       const std::vector<StepRecord>& steps) {
  std::vector<double> time;
  time.reserve(steps.size());
  for (const StepRecord& step : steps) time.push_back(step.time);
  render::Plot plot{.title = title, .x_label = "time [s]", .y_label = "energy [J]", .series = {}};
  const auto add = [&](const std::string& name, auto get) {
    std::vector<double> values;
    bool any = false;
    for (const StepRecord& step : steps) {
      values.push_back(get(step.energies));
      any = any || values.back() != 0;
    }
    if (any) plot.series.push_back({name, render::palette(static_cast<int>(plot.series.size())), time, values});
  };
  add("elastic", [](const Energies& e) { return e.elastic; });
  add("kinetic", [](const Energies& e) { return e.kinetic; });
  add("rigid kinetic", [](const Energies& e) { return e.rigid_kinetic; });
  add("gravitational", [](const Energies& e) { return e.gravitational; });
  add("total", [](const Energies& e) { return e.total(); });
  if (!plot.series.empty()) render::write_svg(path, plot);
}

}  // namespace penalty::demo
