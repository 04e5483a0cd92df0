// The registered cloud that a model was built from, displayed beside the model.
#pragma once

#include <filesystem>
#include <string>

#include "protocols/frames.hpp"
#include "protocols/status.hpp"

namespace parhelion::tools {

/// Reads a cloud (as `map register` writes it, or any that `map model` reads) for StationOptions::cloud,
/// transformed by `T_map_cloud` of its model and thinned evenly to at most `max_points` points. Errors are
/// those of read_scan.
Result<std::string> cloud_layer(const std::filesystem::path& path, const Transform<Map, Cloud>& T_map_cloud,
                                std::size_t max_points = 120'000);

}  // namespace parhelion::tools
