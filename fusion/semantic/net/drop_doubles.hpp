// Removes duplicates: of two boxes with the same label in the same place, only the more certain one is kept.
#pragma once

#include <cstddef>

#include "protocols/model.hpp"

namespace parhelion::semantic {

/// Removes, with its relations, the less certain (if equal, the later) of each pair of entities that a model
/// file may not contain together (see find_overlap). The first `given` entities are always kept; a pair of
/// two of them is left alone. Returns the number of removed entities.
std::size_t drop_doubles(SemanticModel& model, std::size_t given = 0);

}  // namespace parhelion::semantic
