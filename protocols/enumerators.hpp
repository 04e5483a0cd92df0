// Converts between enumerators and their names in to_string().
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace parhelion {

/// Names of the enumerators up to and including `last`, in their order.
template <class Enum>
std::vector<std::string> names_up_to(Enum last) {
  std::vector<std::string> names;
  for (int i = 0; i <= static_cast<int>(last); ++i) names.emplace_back(to_string(static_cast<Enum>(i)));
  return names;
}

/// The enumerator of this name, among those up to `last`.
template <class Enum>
std::optional<Enum> enumerator(std::string_view name, Enum last) {
  for (int i = 0; i <= static_cast<int>(last); ++i)
    if (name == to_string(static_cast<Enum>(i))) return static_cast<Enum>(i);
  return std::nullopt;
}

}  // namespace parhelion
