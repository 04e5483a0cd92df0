// What is wrong with JSON that cannot be read.
#pragma once

#include <cstring>
#include <exception>
#include <string>
#include <string_view>

namespace parhelion::training {

/// The library's message without its leading number.
inline std::string json_reason(const std::exception& error) {
  const char* text = std::strstr(error.what(), "] ");
  return text == nullptr ? error.what() : text + 2;
}

/// Whether lists and objects are more than `levels` deep: the library would need as many stack frames.
inline bool nested_deeper(std::string_view text, int levels) {
  int depth = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted && c == '\\')
      ++i;
    else if (c == '"')
      quoted = !quoted;
    else if (!quoted && (c == '[' || c == '{') && ++depth > levels)
      return true;
    else if (!quoted && (c == ']' || c == '}'))
      --depth;
  }
  return false;
}
inline constexpr int kMaxJsonLevels = 100;
inline constexpr const char* kTooDeep = ": nested more than 100 levels deep; expected records";

}  // namespace parhelion::training
