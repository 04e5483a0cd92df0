// Locates files that are installed with the program: presets, robots, programmes.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace parhelion {

/// Path of an installed file such as "fusion/scan/presets/lms-200.yaml": under $PARHELION_SHARE where set,
/// else share/parhelion in the nearest folder above the running program that has it.
std::filesystem::path share_path(std::string_view relative);

/// Names of the installed YAML files of a folder such as "server/robots", sorted, without their extension.
std::vector<std::string> shipped_names(std::string_view folder);
/// The installed file of that name, or the path itself if it ends with ".yaml"; nullopt: neither.
std::optional<std::string> path_of_shipped(std::string_view folder, const std::string& name_or_path);

}  // namespace parhelion
