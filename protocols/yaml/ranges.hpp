// Values given as a range: {from: 0.3 m/s, to: 0.8 m/s}.
#pragma once

#include <cstdint>
#include <vector>

#include "protocols/fault.hpp"
#include "protocols/yaml/document.hpp"

namespace parhelion::yaml {

/// Replaces each map of only `from` and `to` by a single uniformly drawn value: a function of the seed and of
/// the position in the document, so that adding another range does not change it. Both must have the same
/// unit; whole numbers without a unit are drawn as whole numbers, both ends included. Returns the drawn
/// values in file order; an invalid range goes to `problems`.
std::vector<DrawnValue> draw_ranges(Node& root, std::uint64_t seed, Problems& problems);

}  // namespace parhelion::yaml
