#include "study/results_directory.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <stdexcept>

#include "main/usage_error.h"

namespace penalty::study {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> result_files(const std::vector<fs::path>& paths) {
  std::vector<fs::path> files;
  for (const fs::path& path : paths) {
    if (!fs::is_directory(path)) {
      files.push_back(path);
      continue;
    }
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(path)) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with("results-") && name.ends_with(".jsonl")) found.push_back(entry.path());
    }
    std::sort(found.begin(), found.end());
    files.insert(files.end(), found.begin(), found.end());
  }
  return files;
}

std::string contents(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file || fs::is_directory(path)) throw demo::UsageError(path.string() + ": cannot be read");
  return text;
}

}  // namespace

std::vector<StudyResult> read_results(const std::vector<fs::path>& paths) {
  std::vector<StudyResult> results;
  for (const fs::path& path : result_files(paths)) {
    const std::string text = contents(path);
    int line = 1;
    for (std::size_t begin = 0, end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1, ++line) try {
        results.push_back(from_line(text.substr(begin, end - begin)));
      } catch (const std::runtime_error& error) {
        throw demo::UsageError(path.string() + ":" + std::to_string(line) + ": " + error.what());
      }
  }
  return results;
}

std::vector<StudyResult> merged(const std::vector<StudyResult>& results) {
  std::vector<StudyResult> unique;
  std::map<std::string, std::size_t> place;
  for (const StudyResult& result : results) {
    const auto [found, is_new] = place.emplace(result.which.id(), unique.size());
    if (is_new)
      unique.push_back(result);
    else if (!unique[found->second].agrees_with(result))
      throw std::runtime_error("two results of " + found->first + " contradict each other");
  }
  return unique;
}

ResultFile::ResultFile(const fs::path& directory, int shard, int num_shards) {
  const auto fail = [&](const std::string& what) { throw demo::UsageError(path_.string() + ": " + what); };
  std::error_code error;
  fs::create_directories(directory, error);
  path_ = directory / ("results-" + std::to_string(shard) + "-of-" + std::to_string(num_shards) + ".jsonl");
  file_ = open(path_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (file_ < 0) fail(std::string("cannot be written: ") + std::strerror(errno));
  try {
    if (flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) fail("another run is writing it");
    const std::string text = contents(path_);
    const std::size_t last = text.rfind('\n'), whole = last == std::string::npos ? 0 : last + 1;
    if (whole < text.size() && ftruncate(file_, static_cast<off_t>(whole)) != 0)
      fail(std::string("cannot be repaired: ") + std::strerror(errno));
  } catch (...) {
    close(file_);
    throw;
  }
}

ResultFile::~ResultFile() { close(file_); }

void ResultFile::append(const StudyResult& result) {
  const std::string line = to_line(result) + "\n";
  const ssize_t written = write(file_, line.data(), line.size());
  if (written != static_cast<ssize_t>(line.size()))
    throw std::runtime_error(path_.string() +
                             ": cannot be written: " + (written < 0 ? std::strerror(errno) : "no space"));
}

}  // namespace penalty::study
