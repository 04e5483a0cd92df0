// CSV fields according to RFC 4180.
#pragma once

#include <charconv>
#include <string>

namespace parhelion::training {

inline std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char letter : text) quoted += letter == '"' ? std::string("\"\"") : std::string(1, letter);
  return quoted + "\"";
}

/// The shortest text that converts back to the same bits.
template <class Number>
std::string csv_number(Number number) {
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, number);
  return {text, end.ptr};
}

}  // namespace parhelion::training
