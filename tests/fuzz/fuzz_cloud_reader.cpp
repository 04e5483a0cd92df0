// The readers of 3D scans on hostile bytes: they end, and what they return is finite and could have been in
// the file.
#include <cstdlib>

#include "fusion/cloud/read_cloud.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const auto format = static_cast<parhelion::cloud::ScanFormat>(data[0] % 6);
  parhelion::cloud::ReadOptions options;
  options.memory = std::uint64_t{1} << 30;
  const auto scan = parhelion::cloud::parse_scan(bytes, "fuzz", format, options);
  (void)parhelion::cloud::parse_uos_pose(bytes, "fuzz");
  if (!scan) return scan.error().message.empty() ? (std::abort(), 0) : 0;
  const auto& cloud = scan->cloud;
  // A compressed block may unpack to 88 times its size; a point has three bytes at the least. Two bytes of an
  // octree may be eight leaves of 56 points.
  if (cloud.size() > size * (format == parhelion::cloud::ScanFormat::octree ? 224 : 30)) std::abort();
  for (const auto& point : cloud.points) {
    if (!point.allFinite()) std::abort();
  }
  for (const std::size_t column :
       {cloud.normals.size(), cloud.colours.size(), cloud.labels.size(), cloud.scans.size()}) {
    if (column != 0 && column != cloud.size()) std::abort();
  }
  return 0;
}
