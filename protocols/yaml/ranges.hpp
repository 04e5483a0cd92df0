// Values that are given as a range: {from: 0.3 m/s, to: 0.8 m/s}.
#pragma once

#include <cstdint>
#include <vector>

#include "protocols/lesson.hpp"
#include "protocols/yaml/document.hpp"

namespace parhelion::yaml {

/// Puts a single value in the place of each map of `from` and `to` alone, evenly drawn: a function of the
/// seed and of the place, so that another range elsewhere changes nothing here. Both have the same unit;
/// whole numbers without one are drawn whole, both ends included. What was drawn, in file order; a range that
/// cannot be drawn from goes to `problems`.
std::vector<DrawnValue> draw_ranges(Node& root, std::uint64_t seed, Problems& problems);

}  // namespace parhelion::yaml
