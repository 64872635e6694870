// Recovery rates as a picture.
#pragma once
#include <filesystem>
#include <vector>

#include "study/table.h"

namespace penalty::study {

/// A PNG with a row for each run, material and mesh of each suite: the rate of recovery from random starts with its 95
/// % interval, and how many of the exact starts. Needs no OpenGL. Throws std::invalid_argument without rows or for a
/// file that does not end in .png, and std::runtime_error if the file cannot be written.
void write_rate_plot(const std::filesystem::path& path, const std::vector<TableRow>& rows);

}  // namespace penalty::study
