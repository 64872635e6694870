// A clip: frames go through a pipe to ffmpeg, or, where there is none, into numbered PNG files.
#pragma once
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "render/image.h"

namespace penalty::render {

struct VideoOptions {
  double frames_per_second = 30;
  int quality = 20;               // x264's constant rate factor: less is better and larger
  std::string ffmpeg = "ffmpeg";  // a name on the PATH, or a path
};

/// The ending of `path` chooses the format: .mp4 (H.264, yuv420p, starts before it is loaded) or .webp (animated).
class VideoWriter {
 public:
  /// Throws std::invalid_argument for another ending, size or rate.
  VideoWriter(std::filesystem::path path, int width, int height, VideoOptions options = {});
  /// Ends ffmpeg if finish() was never reached; the file is then incomplete.
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  /// Throws std::invalid_argument for an image of another size, std::runtime_error with ffmpeg's words if it died.
  void add(const Image& image);

  /// Waits for ffmpeg. Throws std::runtime_error with ffmpeg's words unless it succeeded.
  void finish();

  /// False where ffmpeg is missing: the frames are then frame_00000.png, ... in frames_directory().
  bool encoded() const { return encoded_; }
  std::filesystem::path frames_directory() const;
  /// What encodes the PNG files, for a shell.
  std::string command() const;
  int frames() const { return frames_; }

 private:
  std::vector<std::string> arguments(bool from_pipe) const;
  bool start();
  [[noreturn]] void fail(const std::string& what);
  int wait();

  std::filesystem::path path_;
  int width_, height_;
  VideoOptions options_;
  bool encoded_ = false, finished_ = false;
  int frames_ = 0;
  int process_ = -1;
  int socket_ = -1;
  std::FILE* messages_ = nullptr;  // ffmpeg's standard error
};

}  // namespace penalty::render
