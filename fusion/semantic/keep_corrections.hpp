// What a person corrected in a model stays when the model is made anew.
#pragma once

#include <string>
#include <vector>

#include "protocols/model.hpp"

namespace parhelion::semantic {

/// What became of the corrections, for a person.
struct KeptCorrections {
  std::size_t locked = 0;             ///< entities that a person locked, kept as they were
  std::size_t deleted = 0;            ///< that a person deleted, and what was found there again left out
  std::size_t drawn = 0;              ///< virtual ones
  std::vector<std::string> replaced;  ///< names that the new run had given to what is kept
};

/// Puts the corrections of `old` into `made`: locked and virtual entities replace what the new run found in
/// their place, deleted ones take it away and stay in the list, not solid. An old entity and a new one are
/// the same where they share more than 0.4 of the smaller one's volume, each grown by 0.05 m (two runs differ
/// by their noise); of free spaces none is taken away but by a free space. `old` is brought into the new
/// run's frame by the two T_map_cloud. Relations follow the names; those of what is gone go too. Meshes are
/// the new run's.
KeptCorrections keep_corrections(const SemanticModel& old, SemanticModel& made);

}  // namespace parhelion::semantic
