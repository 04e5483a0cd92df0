// Lines, words and numbers of external text, with their position for error messages.
#pragma once

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "protocols/status.hpp"

namespace parhelion::cloud {

/// Lines of a text, without line endings (LF or CRLF).
class LineCursor {
 public:
  explicit LineCursor(std::string_view text, std::size_t offset = 0, std::uint64_t number = 0)
      : text_(text), next_(offset), number_(number) {}

  /// The next line; nullopt at the end.
  std::optional<std::string_view> next() {
    if (next_ >= text_.size()) return std::nullopt;
    const std::size_t begin = next_, end = std::min(text_.find('\n', begin), text_.size());
    next_ = end + 1;
    ++number_;
    std::string_view line = text_.substr(begin, end - begin);
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }
  std::uint64_t number() const { return number_; }  ///< of the last line, from 1
  std::size_t offset() const {
    return next_ < text_.size() ? next_ : text_.size();
  }  ///< byte after the last line

 private:
  std::string_view text_;
  std::size_t next_;
  std::uint64_t number_;
};

/// Removes the first word from `rest` and returns it; empty at the end. Separators: space, tab and `also`.
inline std::string_view next_token(std::string_view& rest, char also = ' ') {
  const auto separates = [also](char c) { return c == ' ' || c == '\t' || c == also; };
  std::size_t begin = 0;
  while (begin < rest.size() && separates(rest[begin])) ++begin;
  std::size_t end = begin;
  while (end < rest.size() && !separates(rest[end])) ++end;
  const std::string_view word = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return word;
}

/// Parses the whole word as a number; nan and inf are accepted for floating types.
template <class Number>
std::optional<Number> parse_number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  Number number{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return number;
}

Error error_at_line(const std::string& name, std::uint64_t line, const std::string& what);
Error error_at_byte(const std::string& name, std::uint64_t offset, const std::string& what);
/// `word` in quotes, truncated and made printable.
std::string in_quotes(std::string_view word);

}  // namespace parhelion::cloud
