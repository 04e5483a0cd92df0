#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/maps/COccupancyGridMap2D.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>
#include <mrpt/serialization/CArchive.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <vector>

#include "fusion/pose/maps/mapped_scan.hpp"
#include "fusion/pose/mrpt/conversion.hpp"
#include "protocols/isolation.hpp"

namespace parhelion::pose {
namespace {

// Of reading a map.
constexpr std::uint64_t kMinBytes = std::uint64_t{1} << 29U;
constexpr std::uint64_t kMinSeconds = 1, kBytesPerSecond = 500'000;
// A map of more is damaged: its grids would take gigabytes.
constexpr double kFarthest = 1e6, kMaxArea = 1e6;  ///< m from the map's origin, and m^2

mrpt::maps::CSimpleMap simplemap_of(std::span<const MappedScan> scans) {
  mrpt::maps::CSimpleMap map;
  for (const MappedScan& mapped : scans) {
    if (mapped.scan.ranges.size() < 2) continue;
    const auto frame = mrpt::obs::CSensoryFrame::Create();
    frame->insert(to_mrpt(mapped));
    const auto pose = mrpt::poses::CPose3DPDFGaussian::Create();
    pose->mean =
        to_mrpt(Transform<Map, Base>::planar(mapped.T_map_base.x, mapped.T_map_base.y, mapped.T_map_base.yaw)
                    .isometry());
    map.insert(pose, frame);
  }
  return map;
}

/// All 2D range scans. Throws where the file is damaged, and may crash.
std::vector<MappedScan> load(const std::string& path) {
  mrpt::maps::CSimpleMap map;
  mrpt::io::CFileGZInputStream file(path);
  mrpt::serialization::archiveFrom(file) >> map;
  return scans_of(map);
}

/// A scan as bytes, from the child that has read it: all but the ranges, their number, the ranges.
struct PackedScan {
  double x, y, yaw, range_max;
  double T_base_laser[16];
  float angle_min, angle_increment;
  std::uint64_t ranges;
};

std::string packed(std::span<const MappedScan> scans) {
  std::string bytes;
  for (const MappedScan& scan : scans) {
    PackedScan head{
        scan.T_map_base.x,   scan.T_map_base.y,         scan.T_map_base.yaw,    scan.range_max, {},
        scan.scan.angle_min, scan.scan.angle_increment, scan.scan.ranges.size()};
    Eigen::Map<Eigen::Matrix4d>(head.T_base_laser) = scan.T_base_laser.isometry().matrix();
    bytes.append(reinterpret_cast<const char*>(&head), sizeof head);
    bytes.append(reinterpret_cast<const char*>(scan.scan.ranges.data()),
                 scan.scan.ranges.size() * sizeof(float));
  }
  return bytes;
}

std::vector<MappedScan> unpacked(const std::string& bytes) {
  std::vector<MappedScan> scans;
  for (std::size_t at = 0; at < bytes.size();) {
    PackedScan head;
    std::memcpy(&head, bytes.data() + at, sizeof head);
    at += sizeof head;
    MappedScan& scan = scans.emplace_back();
    scan.T_map_base = {head.x, head.y, head.yaw};
    Eigen::Isometry3d T;
    T.matrix() = Eigen::Map<const Eigen::Matrix4d>(head.T_base_laser);
    scan.T_base_laser = Transform<Base, Laser>(T);
    scan.range_max = head.range_max;
    scan.scan.angle_min = head.angle_min;
    scan.scan.angle_increment = head.angle_increment;
    scan.scan.ranges.resize(head.ranges);
    std::memcpy(scan.scan.ranges.data(), bytes.data() + at, head.ranges * sizeof(float));
    at += head.ranges * sizeof(float);
  }
  return scans;
}

/// Error: a point or pose that is not finite or too far away, or a map that is too large.
Status check_extent(std::span<const MappedScan> scans, const std::string& path) {
  Eigen::AlignedBox2d extent;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    std::vector<Eigen::Vector2d> reached{scans[i].T_map_base.position()};
    for (const Eigen::Vector2d& p : points_of(scans[i])) reached.push_back(scans[i].T_map_base * p);
    for (const Eigen::Vector2d& p : reached) {
      if (!p.allFinite() || p.cwiseAbs().maxCoeff() > kFarthest)
        return Error{path + ": scan " + std::to_string(i + 1) + " reaches farther than 1000 km from the " +
                     "map's origin; the file is damaged, make the map again"};
      extent.extend(p);
    }
  }
  constexpr double margin = 20;  // of the grids
  if ((extent.sizes().array() + margin).prod() > kMaxArea)
    return Error{path + ": its scans cover " + std::to_string(std::lround(extent.sizes().x())) + " m x " +
                 std::to_string(std::lround(extent.sizes().y())) +
                 " m, expected at most 1 km^2; the file is damaged, make the map again"};
  return {};
}

}  // namespace

Status write_simplemap(std::span<const MappedScan> scans, const std::string& path) {
  if (!simplemap_of(scans).saveToFile(path)) {
    return Error{path + ": could not be written: does the directory exist and is there room on the disk?"};
  }
  return {};
}

Result<std::vector<MappedScan>> read_simplemap(const std::string& path) {
  const Error unreadable{
      path +
      ": is not a readable .simplemap; expected a file of MRPT (gzip) with CSimpleMap in it, undamaged"};
  if (access(path.c_str(), R_OK) != 0) return Error{path + ": cannot be opened: " + std::strerror(errno)};
  std::error_code no_file;
  const std::uint64_t size = std::filesystem::file_size(path, no_file);
  if (no_file) return unreadable;
  const ChildLimits limits{kMinBytes + 16 * size, kMinSeconds + size / kBytesPerSecond};
  const auto read = result_of_child(limits, [&](const auto&) { return packed(load(path)); });
  if (!read) return read.error();
  if (!read->end.completed) return unreadable;
  std::vector<MappedScan> scans = unpacked(read->bytes);
  if (scans.empty()) return Error{path + ": contains no 2D range scan, expected at least one"};
  if (const Status extent = check_extent(scans, path); !extent) return extent.error();
  return scans;
}

std::vector<Eigen::Vector2d> points_of(const MappedScan& mapped) {
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < mapped.scan.ranges.size(); ++i) {
    const auto range = static_cast<double>(mapped.scan.ranges[i]);
    if (!std::isfinite(range)) continue;
    const double angle = mapped.scan.angle(i);
    points.push_back(
        (mapped.T_base_laser * Eigen::Vector3d(range * std::cos(angle), range * std::sin(angle), 0))
            .head<2>());
  }
  return points;
}

namespace {

/// A cell that a scan has hit, and its probability of being free before that scan.
struct HitCell {
  int x = 0, y = 0;
  float free = 0.5F;
};

std::vector<HitCell> hit_cells(const mrpt::maps::COccupancyGridMap2D& grid, const MappedScan& scan) {
  std::vector<std::pair<int, int>> cells;
  for (const Eigen::Vector2d& p : points_of(scan)) {
    const Eigen::Vector2d q = scan.T_map_base * p;
    cells.emplace_back(grid.x2idx(static_cast<float>(q.x())), grid.y2idx(static_cast<float>(q.y())));
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  std::vector<HitCell> hits;
  for (const auto& [x, y] : cells) hits.push_back({x, y, grid.getCell(x, y)});
  return hits;
}

/// After one hit more, as MRPT's default.
float with_hit(float free) {
  constexpr float hit = 0.25F;  // of being free
  return free * hit / (free * hit + (1 - free) * (1 - hit));
}

/// Throws std::bad_alloc where MRPT's grid would not find the memory: its own resizing is noexcept, and would
/// end the program.
void require_memory(std::size_t cells) {
  constexpr std::size_t copies = 3, more = 32 << 20;  // while it is resized; bytes
  std::vector<std::int8_t> probe;
  probe.reserve(copies * cells + more);
}

}  // namespace

GridMap grid_of(std::span<const MappedScan> scans, double resolution) {
  GridMap map;
  map.resolution = resolution;
  Eigen::Vector2d low(-1, -1), high(1, 1);
  bool any = false;
  const auto reach = [&](const Eigen::Vector2d& p) {
    low = any ? Eigen::Vector2d(low.cwiseMin(p)) : p;
    high = any ? Eigen::Vector2d(high.cwiseMax(p)) : p;
    any = true;
  };
  for (const MappedScan& scan : scans) {
    reach(scan.T_map_base.position());
    for (const Eigen::Vector2d& p : points_of(scan)) reach(scan.T_map_base * p);
  }
  // Whole cells with a margin of a metre, so that the same scans give the same cells.
  const long x0 = std::lround(std::floor((low.x() - 1) / resolution)),
             y0 = std::lround(std::floor((low.y() - 1) / resolution));
  const long x1 = std::lround(std::ceil((high.x() + 1) / resolution)),
             y1 = std::lround(std::ceil((high.y() + 1) / resolution));
  require_memory(static_cast<std::size_t>(x1 - x0) * static_cast<std::size_t>(y1 - y0));
  mrpt::maps::COccupancyGridMap2D grid(static_cast<float>(static_cast<double>(x0) * resolution),
                                       static_cast<float>(static_cast<double>(x1) * resolution),
                                       static_cast<float>(static_cast<double>(y0) * resolution),
                                       static_cast<float>(static_cast<double>(y1) * resolution),
                                       static_cast<float>(resolution));
  grid.insertionOptions.maxDistanceInsertion = 80;
  grid.insertionOptions.considerInvalidRangesAsFreeSpace = false;
  grid.insertionOptions.maxFreenessUpdateCertainty = 0.535F;
  for (const MappedScan& mapped : scans) {
    if (mapped.scan.ranges.size() < 2) continue;
    const auto pose =
        to_mrpt(Transform<Map, Base>::planar(mapped.T_map_base.x, mapped.T_map_base.y, mapped.T_map_base.yaw)
                    .isometry());
    const std::vector<HitCell> hits = hit_cells(grid, mapped);
    grid.insertObservation(*to_mrpt(mapped), pose);
    for (const HitCell& hit : hits) grid.setCell(hit.x, hit.y, with_hit(hit.free));
    map.path.emplace_back(mapped.T_map_base.x, mapped.T_map_base.y, mapped.T_map_base.yaw);
  }
  map.x_min = static_cast<double>(x0) * resolution, map.y_min = static_cast<double>(y0) * resolution;
  map.width = static_cast<int>(x1 - x0), map.height = static_cast<int>(y1 - y0);
  map.occupied.assign(static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height), 0.5F);
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const int gx = grid.x2idx(map.x_min + (x + 0.5) * resolution),
                gy = grid.y2idx(map.y_min + (y + 0.5) * resolution);
      map.occupied[static_cast<std::size_t>(y) * static_cast<std::size_t>(map.width) +
                   static_cast<std::size_t>(x)] = 1 - grid.getCell(gx, gy);
    }
  }
  map.id = grid_map_id(map);
  return map;
}

}  // namespace parhelion::pose
