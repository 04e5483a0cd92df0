// Suggestions for misspelt names.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace parhelion {

/// The name nearest to `word` (restricted Damerau-Levenshtein distance at most 2, or a third of its length),
/// or empty.
std::string nearest_name(std::string_view word, const std::vector<std::string>& names);

/// ", did you mean 'agents'?", or empty.
std::string suggestion(std::string_view word, const std::vector<std::string>& names);

/// As suggestion(); without a near name: "; known: agents, doors and 3 more", or "; there is none".
std::string suggestion_or_known(std::string_view word, const std::vector<std::string>& names);

}  // namespace parhelion
