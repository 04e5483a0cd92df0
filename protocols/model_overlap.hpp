// Overlap between boxes of a model.
#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "protocols/model.hpp"

namespace parhelion {

/// Fraction of the smaller box's volume that lies in the other, 0..1. Exact for upright boxes (to about 0.02
/// for tilted ones, which are sampled).
double overlap_fraction(const ModelEntity& a, const ModelEntity& b);

/// The first pair (by index) of solid entities with the same label, both virtual or both not, that overlap by
/// more than half of the smaller one's volume. Doors may open into one another's free space.
std::optional<std::pair<std::size_t, std::size_t>> find_overlap(const std::vector<ModelEntity>& entities);

}  // namespace parhelion
