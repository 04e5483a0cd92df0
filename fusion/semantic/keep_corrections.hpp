// Keeps a user's corrections of a model when the model is rebuilt.
#pragma once

#include <string>
#include <vector>

#include "protocols/model.hpp"

namespace parhelion::semantic {

/// Summary of the kept corrections, for messages.
struct KeptCorrections {
  std::size_t locked = 0;             ///< entities that the user locked, kept unchanged
  std::size_t deleted = 0;            ///< entities that the user deleted; new detections there are dropped
  std::size_t drawn = 0;              ///< virtual entities
  std::vector<std::string> replaced;  ///< names of new entities that kept ones replaced
};

/// Applies the corrections of `old` to `made`: locked and virtual entities replace new ones in the same
/// place, deleted ones remove them and stay in the list, not solid. An old and a new entity are the same
/// where the intersection exceeds 0.4 of the smaller one's volume, each grown by 0.05 m (two runs differ by
/// their noise); a free space is only removed by a free space. `old` is transformed to the new run's frame by
/// the two T_map_cloud. Relations follow the names; those of removed entities are removed. Meshes are the new
/// run's.
KeptCorrections keep_corrections(const SemanticModel& old, SemanticModel& made);

}  // namespace parhelion::semantic
