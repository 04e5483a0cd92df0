// The words of the command line for how a cloud's file is to be read.
#pragma once

#include <map>
#include <string>

#include "fusion/cloud/read_cloud.hpp"

namespace parhelion::tools {

inline const std::map<std::string, cloud::LengthUnit> kLengthUnits = {{"m", cloud::LengthUnit::metre},
                                                                      {"cm", cloud::LengthUnit::centimetre},
                                                                      {"mm", cloud::LengthUnit::millimetre},
                                                                      {"ft", cloud::LengthUnit::foot},
                                                                      {"in", cloud::LengthUnit::inch}};
inline const std::map<std::string, cloud::FileAxes> kFileAxes = {
    {"z-up", cloud::FileAxes::x_forward_z_up},
    {"y-up", cloud::FileAxes::x_right_y_up},
    {"y-down", cloud::FileAxes::x_right_y_down},
    {"y-up-left-handed", cloud::FileAxes::x_right_y_up_mirrored}};

}  // namespace parhelion::tools
