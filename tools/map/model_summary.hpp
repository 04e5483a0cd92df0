// Summary of a model built from a cloud, as JSON.
#pragma once

#include <string>

#include "fusion/semantic/build_model.hpp"
#include "fusion/semantic/model_quality.hpp"

namespace parhelion::tools {

/// Heights are in the coordinates of the levelled cloud, before the model was moved; lengths in m, yaws in
/// rad. floor_m, ceiling_m and room_height_m (their difference) are null if not found. heights: of the points
/// of floor and ceiling (5, 50, 95 percent, inclination), and near each scanner. quality: one line and its
/// numbers; doubtful: parts with place and reason, the largest first.
std::string model_summary(const semantic::BuiltModel& built, const semantic::ModelQuality& quality,
                          double seconds);

}  // namespace parhelion::tools
