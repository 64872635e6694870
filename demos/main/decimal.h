// Numbers on a command line, as people write them.
#pragma once
#include <CLI/CLI.hpp>
#include <initializer_list>
#include <string>

namespace penalty::demo {

/// Makes the options of these names decimal. The C library behind CLI11 would take 0x10 for 16, and, where a whole
/// number is wanted, 010 for 8.
inline void read_as_decimal(CLI::App& app, std::initializer_list<const char*> names) {
  const CLI::Validator decimal(
      [](std::string& text) -> std::string {
        if (text.find_first_of("xX") != std::string::npos) return text + " is not a decimal number";
        const std::size_t sign = text.find_first_of("+-") == 0 ? 1 : 0;
        if (text.find_first_not_of("0123456789", sign) == std::string::npos)
          while (text.size() > sign + 1 && text[sign] == '0') text.erase(sign, 1);
        return "";
      },
      "");
  for (const char* name : names) app.get_option(name)->transform(decimal);
}

}  // namespace penalty::demo
