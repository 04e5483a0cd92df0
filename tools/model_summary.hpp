// What was found in a cloud, as JSON.
#pragma once

#include <string>

#include "fusion/semantic/build_model.hpp"

namespace parhelion::tools {

/// Heights in the levelled cloud's coordinates, whatever the model was moved by; lengths in m, yaws in rad.
/// floor_m, ceiling_m and room_height_m (between them) are null where none was found. heights: of the points
/// of both (5, 50, 95 percent, lean against level), and near each scanner.
std::string model_summary(const semantic::BuiltModel& built, double seconds);

}  // namespace parhelion::tools
