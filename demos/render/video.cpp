#include "render/video.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <stdexcept>

extern char** environ;  // NOLINT: POSIX leaves it to the program to declare

namespace penalty::render {
namespace {

std::string quoted(const std::string& word) {
  const auto plain = [](unsigned char c) { return std::isalnum(c) || std::strchr("+-_./:,=%@", c); };
  if (!word.empty() && std::all_of(word.begin(), word.end(), plain)) return word;
  std::string result = "'";
  for (const char c : word) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

std::string rate_text(double rate) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.6g", rate);
  return buffer.data();
}

}  // namespace

VideoWriter::VideoWriter(std::filesystem::path path, int width, int height, VideoOptions options)
    : path_(std::move(path)), width_(width), height_(height), options_(std::move(options)) {
  if (width <= 0 || height <= 0) throw std::invalid_argument("VideoWriter: both sizes must be positive");
  if (!(options_.frames_per_second > 0) || !std::isfinite(options_.frames_per_second))
    throw std::invalid_argument("VideoWriter: the frame rate must be positive");
  if (path_.extension() != ".mp4" && path_.extension() != ".webp")
    throw std::invalid_argument("VideoWriter: " + path_.string() + " must end in .mp4 or .webp");
  encoded_ = start();
  if (!encoded_) std::filesystem::create_directories(frames_directory());
}

VideoWriter::~VideoWriter() {
  if (process_ > 0) {
    kill(process_, SIGTERM);
    wait();
  }
  if (messages_) std::fclose(messages_);
}

std::filesystem::path VideoWriter::frames_directory() const {
  return path_.parent_path() / (path_.stem().string() + "_frames");
}

std::vector<std::string> VideoWriter::arguments(bool from_pipe) const {
  const std::string rate = rate_text(options_.frames_per_second);
  std::vector<std::string> words{options_.ffmpeg, "-loglevel", "error", "-nostdin", "-y"};
  const auto append = [&words](std::initializer_list<std::string> more) { words.insert(words.end(), more); };
  if (from_pipe)
    append({"-f", "rawvideo", "-pixel_format", "rgb24", "-video_size",
            std::to_string(width_) + "x" + std::to_string(height_), "-framerate", rate, "-i", "pipe:0"});
  else
    append({"-framerate", rate, "-i", (frames_directory() / "frame_%05d.png").string()});
  if (path_.extension() == ".webp") {
    append({"-c:v", "libwebp", "-quality", "70", "-loop", "0"});
  } else {
    // 4:2:0 needs even sizes; the tags keep players from guessing another matrix for small pictures.
    append({"-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv", "-colorspace", "bt709",
            "-color_primaries", "bt709", "-color_trc", "iec61966-2-1", "-c:v", "libx264", "-preset", "medium", "-crf",
            std::to_string(options_.quality), "-pix_fmt", "yuv420p", "-movflags", "+faststart"});
  }
  // A relative path that begins with a dash, or holds a colon, would be read as something else.
  append({"file:" + path_.string()});
  return words;
}

std::string VideoWriter::command() const {
  std::string line;
  for (const std::string& word : arguments(false)) line.append(line.empty() ? "" : " ").append(quoted(word));
  return line;
}

bool VideoWriter::start() {
  // A socket instead of a pipe: send() can be told not to raise SIGPIPE when ffmpeg dies, without touching the
  // program's signal handlers.
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
    throw std::runtime_error(std::string("VideoWriter: socketpair: ") + std::strerror(errno));
  messages_ = std::tmpfile();
  if (messages_) fcntl(fileno(messages_), F_SETFD, FD_CLOEXEC);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  if (messages_)
    posix_spawn_file_actions_adddup2(&actions, fileno(messages_), STDERR_FILENO);
  else
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  std::vector<std::string> words = arguments(true);
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const int error = posix_spawnp(&process_, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  if (error != 0) {
    process_ = -1;
    close(ends[0]);
    return false;
  }
  socket_ = ends[0];
  return true;
}

void VideoWriter::add(const Image& image) {
  if (finished_) throw std::logic_error("VideoWriter: add() after finish()");
  if (image.width != width_ || image.height != height_)
    throw std::invalid_argument("VideoWriter: a frame of " + std::to_string(image.width) + " x " +
                                std::to_string(image.height) + " in a clip of " + std::to_string(width_) + " x " +
                                std::to_string(height_));
  if (!encoded_) {
    std::array<char, 32> name{};
    std::snprintf(name.data(), name.size(), "frame_%05d.png", frames_);
    write_png(frames_directory() / name.data(), image);
  } else {
    const std::uint8_t* data = image.rgb.data();
    std::size_t left = image.rgb.size();
    while (left > 0) {
      const ssize_t sent = send(socket_, data, left, MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent <= 0) fail("stopped reading");
      data += sent;
      left -= static_cast<std::size_t>(sent);
    }
  }
  ++frames_;
}

void VideoWriter::finish() {
  if (finished_) return;
  finished_ = true;
  if (!encoded_) return;
  if (frames_ == 0) fail("was given no frame");
  const int status = wait();
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) fail("failed");
}

int VideoWriter::wait() {
  if (socket_ >= 0) close(socket_);  // end of file for ffmpeg
  socket_ = -1;
  int status = 0;
  if (process_ > 0)
    while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
    }
  process_ = -1;
  return status;
}

void VideoWriter::fail(const std::string& what) {
  finished_ = true;
  wait();
  std::string said;
  if (messages_) {
    std::array<char, 1024> buffer{};
    if (std::fseek(messages_, 0, SEEK_SET) == 0)
      said.assign(buffer.data(), std::fread(buffer.data(), 1, buffer.size(), messages_));
  }
  throw std::runtime_error(options_.ffmpeg + " " + what + " while writing " + path_.string() +
                           (said.empty() ? "" : ": " + said));
}

}  // namespace penalty::render
