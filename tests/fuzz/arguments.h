// --name N on the command lines of these programs.
#pragma once
#include <charconv>
#include <iostream>
#include <map>
#include <optional>
#include <string>

namespace penalty::testing {

/// The numbers after the names in `known`, as they stand there or on the command line; nothing, and a line on standard
/// error, if it makes no sense. A name whose number is a flag's, 0, may stand alone: it is 1 then.
inline std::optional<std::map<std::string, double>> read_arguments(int argc, char** argv,
                                                                   std::map<std::string, double> known,
                                                                   const std::string& usage) {
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    const auto entry = known.find(name);
    std::string_view text = i + 1 < argc ? argv[i + 1] : "";
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool has_number = error == std::errc() && end == text.data() + text.size() && value >= 0 && !text.empty();
    if (entry == known.end() || (!has_number && entry->second != 0)) {
      std::cerr << usage << '\n';
      return std::nullopt;
    }
    entry->second = has_number ? value : 1;
    i += has_number;
  }
  return known;
}

}  // namespace penalty::testing
