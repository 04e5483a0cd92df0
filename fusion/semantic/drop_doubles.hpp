// One place, one thing: of two boxes of a label in one place only the surer one stays.
#pragma once

#include <cstddef>

#include "protocols/model.hpp"

namespace parhelion::semantic {

/// Takes away, with its relations, the less certain one (the later of two alike) of each pair of entities
/// that a model file may not have both (see find_overlap). The first `given` entities always stay; a pair of
/// two such is left alone. Returns how many went.
std::size_t drop_doubles(SemanticModel& model, std::size_t given = 0);

}  // namespace parhelion::semantic
