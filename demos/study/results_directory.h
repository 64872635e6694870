// Results in files, one line each: what a killed run has left, and what several workers have made.
#pragma once
#include <filesystem>
#include <vector>

#include "study/study_result.h"

namespace penalty::study {

/// The results in `paths`, files or directories of files results-*.jsonl, in the order of their names. A last line that
/// was cut off is left out. Throws std::runtime_error naming file and line for anything else that is no result, and for
/// a path that cannot be read.
std::vector<StudyResult> read_results(const std::vector<std::filesystem::path>& paths);

/// Each case once, in the order of their first lines. Throws std::runtime_error naming the case if two results of it
/// differ in more than times of the CPU.
std::vector<StudyResult> merged(const std::vector<StudyResult>& results);

/// The file that one worker adds to: DIR/results-I-of-N.jsonl.
class ResultFile {
 public:
  /// Makes the directory, opens the file, and takes a line off its end that was cut off. Throws std::runtime_error if
  /// that cannot be done, or if another process has the file open here.
  ResultFile(const std::filesystem::path& directory, int shard, int num_shards);
  ~ResultFile();
  ResultFile(const ResultFile&) = delete;
  ResultFile& operator=(const ResultFile&) = delete;

  /// One write, one line: whoever is killed loses no more than what it was working at.
  void append(const StudyResult& result);

 private:
  std::filesystem::path path_;
  int file_ = -1;
};

}  // namespace penalty::study
