// A run in numbers, as JSON.
#pragma once
#include <nlohmann/json.hpp>

#include "main/recording.h"

namespace penalty::demo {

/// One object; numbers that are not finite, and what has no meaning in the scene, are null.
nlohmann::ordered_json summarize(const Recording& recording, const RunOptions& options, const BodyMesh& body);

/// A few lines for people.
std::string describe(const nlohmann::ordered_json& summary);

}  // namespace penalty::demo
