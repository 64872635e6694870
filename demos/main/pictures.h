// Still and clip of a run that is over: camera and colours are then known for all of it.
#pragma once
#include <filesystem>
#include <functional>
#include <string>

#include "main/recording.h"

namespace penalty::demo {

/// Writes `<scene>.png` and `<scene>.mp4` into `directory`; `progress` is told how many pictures are done, the still
/// first. Returns a remark for the user, or nothing: where ffmpeg is missing, what makes the clip of its frames. Throws
/// std::runtime_error if there is no off-screen OpenGL or a file cannot be written.
std::string draw(const Recording& recording, const RunOptions& options, const SceneSetup& setup, const FramePlan& plan,
                 const std::filesystem::path& directory, const std::function<void(long)>& progress);

/// The same for figures: a still of each, named after it, and a clip of `duration` [s] that goes round the first.
std::string draw(const std::vector<Figure>& figures, const RunOptions& options, Real duration,
                 const std::filesystem::path& directory, const std::function<void(long)>& progress);
long num_figure_frames(Real duration);  // in the clip

}  // namespace penalty::demo
