#include "protocols/nearest_name.hpp"

#include <algorithm>

namespace parhelion {
namespace {

/// Edits (insert, delete, replace, swap of neighbours) from a to b.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

}  // namespace

std::string nearest_name(std::string_view word, const std::vector<std::string>& names) {
  constexpr std::size_t longest = 64;
  if (word.size() > longest) return {};
  std::size_t best = std::max<std::size_t>(2, word.size() / 3) + 1;
  std::string nearest;
  for (const std::string& name : names) {
    const std::size_t distance = edit_distance(word, name);
    if (distance < best && distance < std::max(word.size(), name.size())) {
      best = distance;
      nearest = name;
    }
  }
  return nearest;
}

std::string suggestion(std::string_view word, const std::vector<std::string>& names) {
  const std::string nearest = nearest_name(word, names);
  return nearest.empty() ? "" : ", did you mean '" + nearest + "'?";
}

std::string suggestion_or_known(std::string_view word, const std::vector<std::string>& names) {
  constexpr std::size_t max_names = 8;
  if (std::string near = suggestion(word, names); !near.empty()) return near;
  if (names.empty()) return "; none is defined";
  std::string known = "; known: ";
  for (std::size_t i = 0; i < std::min(names.size(), max_names); ++i) known += (i > 0 ? ", " : "") + names[i];
  return names.size() > max_names ? known + " and " + std::to_string(names.size() - max_names) + " more"
                                  : known;
}

}  // namespace parhelion
