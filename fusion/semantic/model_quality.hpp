// How far a model is to be trusted, and where a person should look first.
#pragma once

#include <string>
#include <vector>

#include "fusion/semantic/build_model.hpp"
#include "protocols/model_objects.hpp"

namespace parhelion::semantic {

struct ModelQuality {
  double walls = 0;                ///< m, length of the walls
  double wall_support = 0;         ///< fraction of their faces that was measured or looked at
  bool has_floor = false;          ///< at least one was found
  double floor_cover = 0;          ///< fraction of the floors' boxes that was measured
  bool up_doubtful = false;        ///< the model may be upside down or lie on its side
  double unknown = 0;              ///< fraction of the points in no entity and no object
  std::vector<ModelDoubt> doubts;  ///< the largest first
};

ModelQuality quality_of(const BuiltModel& built);

/// One line: "walls: 34.2 m, 91 % measured; floors: 80 % measured; 4 % of the points unknown; 2 doubtful
/// parts: wall 3 (only 38 % of it was measured), door 1 (...)"; at most three parts are named.
std::string quality_line(const ModelQuality& quality);

}  // namespace parhelion::semantic
