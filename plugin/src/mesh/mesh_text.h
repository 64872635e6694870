// Text of mesh files: loading, cutting into words and numbers that know their line, and one-line complaints.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "penalty/math/text.h"

namespace penalty {

/// The whole file. Throws MeshError unless it is a readable, non-empty regular file.
std::string load_file(const std::filesystem::path& path);

/// The extension in lower case, with its dot.
std::string lower_extension(const std::filesystem::path& path);

std::string lower_case(std::string_view text);

/// `text` from a file fit for a one-line message: what is not printable ASCII replaced, all beyond `longest` characters
/// cut.
std::string printable(std::string_view text, std::size_t longest = 40);

/// The same between quotes.
std::string in_quotes(std::string_view text);

/// Reads words, numbers and lines from a text. Words end at white space, which includes line ends, those of other systems
/// too; a comment runs from `comment` to the end of its line. Where there are comments, commas are white space. Everything that is missing or malformed throws MeshError with file and line.
class TextCursor {
 public:
  TextCursor(std::string file, std::string_view text, char comment = '\0', int line = 1)
      : file_(std::move(file)), text_(text), comment_(comment), at_line_(line), line_(line) {}

  const std::string& file() const { return file_; }
  int line() const { return line_; }  // of the word or line read last
  std::size_t remaining() const { return text_.size() - at_; }
  bool at_end();  // nothing but white space and comments follows

  std::string_view word(std::string_view what);  // `what` is wanted: for the message
  std::string_view peek() const;                 // the next word, left in place; empty at the end
  std::int64_t integer(std::string_view what);
  Real real(std::string_view what);  // Fortran's 1.0D+00, too; "nan" and "inf" pass: repair() names the coordinate
  std::int64_t count(std::string_view what, std::size_t least_bytes) {  // as `checked_count`
    return checked_count(integer(what), what, least_bytes);
  }
  std::int64_t checked_count(std::int64_t value, std::string_view what,
                             std::size_t least_bytes) const;  // 0 or more, and that many items of least_bytes fit
  void expect(std::string_view word);

  std::string_view rest_of_line();  // without its end, comment or surrounding white space; moves to the next line
  bool at_line_end();               // no other word before the line ends
  std::string_view bytes(std::size_t count, std::string_view what);  // raw

  /// From now on complaints name this element, e.g. ("vertex", 4); an empty kind ends it.
  void within(std::string_view kind, std::int64_t number = 0) { kind_ = kind, number_ = number; }
  [[noreturn]] void fail(std::string_view message) const;

 private:
  bool is_space(char c) const;
  bool ends_line(std::size_t place) const;  // the last byte of a line end stands there
  std::size_t line_end() const;             // from where on the line is over
  void skip_space();

  std::string file_;
  std::string_view text_;
  char comment_;
  std::string_view kind_;
  std::int64_t number_ = 0;
  std::size_t at_ = 0;
  int at_line_;  // of at_
  int line_;
};

}  // namespace penalty
