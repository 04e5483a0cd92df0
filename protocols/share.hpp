// Locates files that are installed with the program: presets, robots, programmes.
#pragma once

#include <filesystem>
#include <string_view>

namespace parhelion {

/// Path of an installed file such as "fusion/scan/presets/lms-200.yaml": under $PARHELION_SHARE where set,
/// else share/parhelion in the nearest folder above the running program that has it.
std::filesystem::path share_path(std::string_view relative);

}  // namespace parhelion
