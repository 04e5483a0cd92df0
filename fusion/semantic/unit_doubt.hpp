// Whether a cloud that was read in metres is in feet or inches.
#pragma once

#include <optional>
#include <string>

#include "protocols/model.hpp"

namespace parhelion::semantic {

/// A unit of length that is no metre.
struct OtherUnit {
  const char* name = "";  ///< plural
  double metres = 1;
};

/// The unit in which the site's storey would be as high as rooms are (2.1 to 3.6 m), where nothing that
/// people use tells that metres are right: no doors and no stairs were found. nullopt: none.
std::optional<OtherUnit> unit_to_try(const SemanticModel& in_metres);

/// Whether a model of the same cloud, read in the unit to try, has what metres lack: two doors, none wider
/// than a leaf (1.3 m), or a flight of stairs. A single gate of a hall (3 by 6.6 m) is as large as a door in
/// feet.
bool fits_people(const SemanticModel& in_other_unit);

}  // namespace parhelion::semantic
