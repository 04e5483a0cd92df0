#include "tools/robot/dialogue.hpp"

#include <charconv>
#include <cmath>

namespace parhelion::tools {

std::optional<std::vector<double>> comma_separated(const std::string& text) {
  std::vector<double> numbers;
  const char *at = text.data(), *const end = at + text.size();
  for (;; ++at) {
    while (at != end && *at == ' ') ++at;
    double value = 0;
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc{} || !std::isfinite(value)) return std::nullopt;
    numbers.push_back(value);
    at = next;
    if (at == end) return numbers;
    if (*at != ',') return std::nullopt;
  }
}

std::string Dialogue::number(const std::string& question, const std::string& likely) const {
  return answer(question, likely, [&](const std::string& text) {
    const auto numbers = comma_separated(text);
    if (!numbers || numbers->size() != 1 || !(numbers->front() >= 0))
      throw WrongAnswer{question + ": expected a number of at least 0, found '" + text + "'"};
    return text;
  });
}

}  // namespace parhelion::tools
