// Runs a program as a user does: arguments in, status and both streams out.
#pragma once
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "render/leaks_of_mesa.h"

namespace penalty::test {

/// A directory of its own, gone at the end.
class TemporaryDirectory {
 public:
  TemporaryDirectory() {
    std::string pattern = (std::filesystem::temp_directory_path() / "penalty-test-XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~TemporaryDirectory() { std::filesystem::remove_all(path_); }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline std::string contents(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

struct Outcome {
  int status = -1;
  std::string output, errors;
};

inline Outcome run_program(const std::string& program, const std::vector<std::string>& arguments,
                           const std::string& environment = "") {
  const TemporaryDirectory directory;
  std::ofstream(directory / "leaks") << leaks_of_mesa;
  std::string command = "LSAN_OPTIONS=suppressions=" + (directory / "leaks").string() + ":print_suppressions=0 " +
                        environment + " '" + program + "'";
  for (const std::string& argument : arguments) command += " '" + argument + "'";
  command += " >" + (directory / "out").string() + " 2>" + (directory / "err").string() + " </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, contents(directory / "out"), contents(directory / "err")};
}

inline std::vector<std::string> words(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> result;
  for (std::string word; stream >> word;) result.push_back(word);
  return result;
}

/// The numbers in a text for people that have more than five significant digits.
inline std::vector<std::string> unreadable_numbers(const std::string& text) {
  std::vector<std::string> result;
  const std::regex number(R"([0-9]+(\.[0-9]+)?)");
  for (std::sregex_iterator at(text.begin(), text.end(), number), end; at != end; ++at) {
    const std::string found = at->str();
    const std::size_t first = std::min(found.find_first_not_of("0."), found.size());
    const auto digits =
        std::count_if(found.begin() + static_cast<std::ptrdiff_t>(first), found.end(), [](char c) { return c != '.'; });
    if (digits > 5) result.push_back(found);
  }
  return result;
}

}  // namespace penalty::test
