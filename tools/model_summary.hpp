// What was found in a cloud, as JSON.
#pragma once

#include <string>

#include "fusion/semantic/build_model.hpp"

namespace parhelion {

/// Heights in the levelled cloud's coordinates, whatever the model was moved by; lengths in m, yaws in rad.
/// floor_m and ceiling_m are null where none was found.
std::string model_summary(const BuiltModel& built, double seconds);

}  // namespace parhelion
