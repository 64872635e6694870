// A run in numbers, as JSON.
#pragma once
#include <nlohmann/json.hpp>

#include "main/recording.h"

namespace penalty::demo {

/// One object; numbers that are not finite, and what has no meaning in the scene, are null.
nlohmann::ordered_json summarize(const Recording& recording, const RunOptions& options, const SceneSetup& setup);

/// The same keys for a scene that is a figure; all that has to do with a run is null.
nlohmann::ordered_json summarize(const std::vector<Figure>& figures, const RunOptions& options);

/// A few lines for people.
std::string describe(const std::vector<Figure>& figures);
std::string describe(const nlohmann::ordered_json& summary, const std::vector<Fact>& facts);

}  // namespace penalty::demo
