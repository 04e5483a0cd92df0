// Reads the SQLite databases of ROS 2 recordings (rosbag2, storage sqlite3, schemas 1 to 4), by receive time.
#pragma once

#include <filesystem>
#include <memory>

#include "tools/import/bag_source.hpp"

namespace parhelion::tools {

/// The file is not changed, and what is beside it is not read. Reading ends with the first error of SQLite.
/// Error: no such database.
Result<std::unique_ptr<BagSource>> open_bag_database(const std::filesystem::path& path);

}  // namespace parhelion::tools
