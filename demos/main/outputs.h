// What a run leaves besides pictures: its course as a table and as curves.
#pragma once
#include <filesystem>

#include "main/recording.h"

namespace penalty::demo {

/// One line a step. Throws std::runtime_error if the file cannot be written.
void write_csv(const std::filesystem::path& path, const std::vector<StepRecord>& steps);

/// Energies over time.
void write_energy_plot(const std::filesystem::path& path, const std::string& title,
                       const std::vector<StepRecord>& steps);

}  // namespace penalty::demo
