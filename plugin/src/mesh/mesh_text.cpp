#include "mesh_text.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <limits>
#include <system_error>

#include "penalty/mesh/tet_mesh.h"

namespace penalty {
namespace {

// from_chars takes no plus sign, files do.
std::string_view without_plus(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  return word;
}

}  // namespace

std::string load_file(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  const std::string name = path.string();
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) throw MeshError(name + ": no such file");
  if (error) throw MeshError(name + ": cannot be opened: " + error.message());
  if (fs::is_directory(status)) throw MeshError(name + ": is a directory, not a mesh file");
  if (!fs::is_regular_file(status)) throw MeshError(name + ": is not a regular file");
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) throw MeshError(name + ": cannot be opened: " + error.message());
  if (size == 0) throw MeshError(name + ": the file is empty");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw MeshError(name + ": cannot be opened");
  std::string text(size, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(size));
  if (static_cast<std::uintmax_t>(stream.gcount()) != size) throw MeshError(name + ": cannot be read to its end");
  if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);  // a byte order mark
  if (text.empty()) throw MeshError(name + ": the file is empty but for a byte order mark");
  if (text.starts_with("version https://git-lfs."))
    throw MeshError(name + ": a pointer of Git LFS, not the file: `git lfs pull` fetches that");
  return text;
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return lower;
}

std::string lower_extension(const std::filesystem::path& path) { return lower_case(path.extension().string()); }

std::string printable(std::string_view text, std::size_t longest) {
  std::string shown(text.substr(0, longest));
  for (char& c : shown)
    if (c < ' ' || c >= '\x7f') c = '?';
  return text.size() > longest ? shown + "..." : shown;
}

std::string in_quotes(std::string_view text) { return std::string("'").append(printable(text)).append("'"); }

void TextCursor::fail(std::string_view message) const {
  std::string text = file_ + ":" + std::to_string(line_) + ": ";
  if (!kind_.empty()) text += std::string(kind_) + " " + std::to_string(number_) + ": ";
  throw MeshError(text + std::string(message));
}

bool TextCursor::is_space(char c) const {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\v' || c == '\f' || (c == ',' && comment_ != '\0');
}

bool TextCursor::ends_line(std::size_t place) const {
  return text_[place] == '\n' || (text_[place] == '\r' && (place + 1 == text_.size() || text_[place + 1] != '\n'));
}

std::size_t TextCursor::line_end() const { return std::min(text_.find_first_of("\r\n", at_), text_.size()); }

void TextCursor::skip_space() {
  for (; at_ < text_.size(); ++at_) {
    if (comment_ != '\0' && text_[at_] == comment_) {
      at_ = line_end();
      if (at_ == text_.size()) break;
    } else if (!is_space(text_[at_])) {
      break;
    }
    if (ends_line(at_)) ++at_line_;
  }
}

bool TextCursor::at_end() {
  skip_space();
  line_ = at_line_;
  return at_ == text_.size();
}

std::string_view TextCursor::peek() const {
  TextCursor ahead = *this;
  return ahead.at_end() ? std::string_view() : ahead.word("a word");
}

std::string_view TextCursor::word(std::string_view what) {
  skip_space();
  line_ = at_line_;
  if (at_ == text_.size()) fail("the file ends where " + std::string(what) + " should stand");
  std::size_t end = at_;
  while (end < text_.size() && !is_space(text_[end]) && (comment_ == '\0' || text_[end] != comment_)) ++end;
  const std::string_view found = text_.substr(at_, end - at_);
  at_ = end;
  return found;
}

std::int64_t TextCursor::integer(std::string_view what) {
  const std::string_view found = word(what), digits = without_plus(found);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size())
    fail(std::string(what) + " is " + in_quotes(found) + ", not an integer");
  return value;
}

Real TextCursor::real(std::string_view what) {
  const std::string_view found = word(what);
  std::string fortran;  // 1.0D+00
  if (found.find_first_of("dD") != found.npos) {
    fortran = found;
    std::replace_if(fortran.begin(), fortran.end(), [](char c) { return c == 'd' || c == 'D'; }, 'e');
  }
  const std::string_view digits = without_plus(fortran.empty() ? found : fortran);
  Real value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (end != digits.data() + digits.size() || error == std::errc::invalid_argument)
    fail(std::string(what) + " is " + in_quotes(found) + ", not a number");
  if (error == std::errc::result_out_of_range) {
    // Too small is zero, too large infinite; from_chars does not say which.
    const bool tiny = digits.find("e-") != digits.npos || digits.find("E-") != digits.npos;
    return tiny ? 0 : std::numeric_limits<Real>::infinity();
  }
  return value;
}

std::int64_t TextCursor::checked_count(std::int64_t value, std::string_view what, std::size_t least_bytes) const {
  if (value < 0) fail(std::string(what) + " is " + std::to_string(value) + ", below zero");
  if (static_cast<std::uint64_t>(value) > remaining() / least_bytes + 1)
    fail(std::string(what) + " is " + std::to_string(value) + ", more than the rest of the file can hold");
  if (value >= std::numeric_limits<int>::max()) fail(std::string(what) + " is " + std::to_string(value) + ", too many");
  return value;
}

void TextCursor::expect(std::string_view wanted) {
  const std::string_view found = word(wanted);
  if (found != wanted) fail("found " + in_quotes(found) + " where " + std::string(wanted) + " should stand");
}

std::string_view TextCursor::rest_of_line() {
  line_ = at_line_;
  const std::size_t end = line_end();
  std::string_view rest = text_.substr(at_, end - at_);
  at_ = end;
  while (at_ < text_.size())
    if (ends_line(at_++)) {
      ++at_line_;
      break;
    }
  if (comment_ != '\0') rest = rest.substr(0, rest.find(comment_));
  while (!rest.empty() && is_space(rest.back())) rest.remove_suffix(1);
  while (!rest.empty() && is_space(rest.front())) rest.remove_prefix(1);
  return rest;
}

bool TextCursor::at_line_end() {
  const std::size_t end = line_end();
  while (at_ < end && is_space(text_[at_])) ++at_;
  return at_ == end || (comment_ != '\0' && text_[at_] == comment_);
}

std::string_view TextCursor::bytes(std::size_t count, std::string_view what) {
  line_ = at_line_;
  if (count > remaining())
    fail("the file ends within " + std::string(what) + ": " + std::to_string(count) + " bytes wanted, " +
         std::to_string(remaining()) + " left");
  const std::string_view raw = text_.substr(at_, count);
  at_ += count;
  at_line_ += static_cast<int>(std::count(raw.begin(), raw.end(), '\n'));
  return raw;
}

}  // namespace penalty
