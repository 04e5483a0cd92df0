#include "fusion/pose/maps/frozen_map.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <exception>
#include <filesystem>
#include <new>

namespace parhelion::pose {
namespace {

constexpr double kSearchResolution = 0.1, kRoughResolution = 0.2;  ///< m
constexpr int kRoughLevels = 6, kMaxRoughLevels = 8;
constexpr double kRoughSquares = 1000;  ///< largest ones of a map
constexpr double kRoughSigma = 0.8;     ///< cells
constexpr double kPerCell = 4;          ///< points that an occupied cell of a grid stands for

bool occupied(const GridMap& grid, int x, int y) {
  if (x < 0 || y < 0 || x >= grid.width || y >= grid.height) return false;
  return grid.occupied[static_cast<std::size_t>(y) * static_cast<std::size_t>(grid.width) +
                       static_cast<std::size_t>(x)] > 0.65F;
}

bool is_free(const GridMap& grid, int x, int y) {
  constexpr float free = 0.4F;  // 0.5: unknown
  if (x < 0 || y < 0 || x >= grid.width || y >= grid.height) return false;
  return grid.occupied[static_cast<std::size_t>(y) * static_cast<std::size_t>(grid.width) +
                       static_cast<std::size_t>(x)] < free;
}

/// Whether `test` holds for a cell no farther than `reach` along x and y.
template <class Test>
bool any_around(int x, int y, int reach, Test&& test) {
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      if (test(x + dx, y + dy)) return true;
    }
  }
  return false;
}

/// Centres of the occupied cells visible to a laser: those beside a free one. A wall is some cells thick, as
/// scans are noisy, and its far side, beside unknown cells, would draw scans into it. Far from the path of
/// the robot nothing may be known to be free; there all cells beside an unknown one count.
std::vector<Eigen::Vector2d> surface(const GridMap& grid) {
  constexpr int thick = 2;  // cells from a wall's visible side
  const auto is_front = [&](int x, int y) {
    return occupied(grid, x, y) && any_around(x, y, 1, [&](int i, int k) { return is_free(grid, i, k); });
  };
  const auto is_inside = [&](int x, int y) {
    return occupied(grid, x - 1, y) && occupied(grid, x + 1, y) && occupied(grid, x, y - 1) &&
           occupied(grid, x, y + 1);
  };
  std::vector<Eigen::Vector2d> points;
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      if (!occupied(grid, x, y)) continue;
      if (any_around(x, y, 1, is_front) || (!is_inside(x, y) && !any_around(x, y, thick, is_front)))
        points.emplace_back(grid.x_min + (x + 0.5) * grid.resolution,
                            grid.y_min + (y + 0.5) * grid.resolution);
    }
  }
  return points;
}

CorrelativeMap rough_map(std::span<const Eigen::Vector2d> points, double resolution) {
  Eigen::AlignedBox2d extent;
  for (const Eigen::Vector2d& p : points) extent.extend(p);
  const double cells = points.empty() ? 0 : extent.volume() / (resolution * resolution);
  int levels = kRoughLevels;
  while (levels < kMaxRoughLevels && cells / std::pow(4.0, levels - 1) > kRoughSquares) ++levels;
  return CorrelativeMap(points, resolution, levels, kRoughSigma);
}

/// What the scans have seen, which reached all these points.
KnownSpace known_space(std::span<const MappedScan> scans, std::span<const Eigen::Vector2d> reached) {
  if (reached.empty()) return {};
  Eigen::AlignedBox2d extent;
  for (const Eigen::Vector2d& p : reached) extent.extend(p);
  KnownSpace known(extent.min(), extent.max());
  for (const MappedScan& scan : scans) {
    const Eigen::Vector2d laser =
        scan.T_map_base * Eigen::Vector2d(scan.T_base_laser.translation().head<2>());
    for (const Eigen::Vector2d& p : points_of(scan)) known.add_beam(laser, scan.T_map_base * p);
  }
  return known;
}

KnownSpace known_space(const GridMap& grid) {
  const Eigen::Vector2d low(grid.x_min, grid.y_min);
  KnownSpace known(low, low + grid.resolution * Eigen::Vector2d(grid.width, grid.height));
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      if (is_free(grid, x, y)) known.add(low + grid.resolution * Eigen::Vector2d(x + 0.5, y + 0.5));
    }
  }
  return known;
}

Result<FrozenMap> from_simplemap(const std::string& path, double resolution) {
  auto scans = read_simplemap(path);
  if (!scans) return scans.error();
  const std::string beside = std::filesystem::path(path).replace_extension(".yaml").string();
  std::error_code ignored;
  if (!std::filesystem::exists(beside, ignored)) return frozen_map_of(*scans, resolution);
  auto grid = load_ros_map(beside);
  if (!grid) return grid.error();
  FrozenMap map = frozen_map_of(*scans, 0);
  map.grid = std::move(*grid);
  return map;
}

Result<FrozenMap> from_grid(const std::string& path) {
  auto grid = load_ros_map(path);
  if (!grid) return grid.error();
  const std::vector<Eigen::Vector2d> points = surface(*grid);
  if (points.size() < 20)
    return Error{path + ": has " + std::to_string(points.size()) + " occupied cells: too few to localize in"};
  FrozenMap map;
  // The points are cells here: a surfel must contain several of them.
  const double cell = std::max(0.1, 2 * grid->resolution);
  map.fine = SurfelMap(cell);
  map.coarse = SurfelMap(4 * cell);
  map.fine.add(points, {}, kPerCell);
  map.coarse.add(points, {}, kPerCell);
  map.likelihood = CorrelativeMap(points, std::max(kSearchResolution, grid->resolution));
  map.rough = rough_map(points, std::max(kRoughResolution, grid->resolution));
  map.fine.finish();
  map.coarse.finish();
  map.known = known_space(*grid);
  map.sigma = map.bias = grid->resolution / 2;
  map.grid = std::move(*grid);
  return map;
}

}  // namespace

FrozenMap frozen_map_of(std::span<const MappedScan> scans, double resolution) {
  FrozenMap map;
  std::vector<Eigen::Vector2d> all;
  for (const MappedScan& scan : scans) {
    const std::vector<Eigen::Vector2d> points = points_of(scan);
    map.fine.add(points, scan.T_map_base);
    map.coarse.add(points, scan.T_map_base);
    for (const Eigen::Vector2d& p : points) all.push_back(scan.T_map_base * p);
  }
  map.fine.finish();
  map.coarse.finish();
  map.likelihood = CorrelativeMap(all, kSearchResolution);
  map.rough = rough_map(all, kRoughResolution);
  map.known = known_space(scans, all);
  if (resolution > 0) map.grid = grid_of(scans, resolution);
  return map;
}

Result<FrozenMap> load_frozen_map(const std::string& path, double resolution) try {
  const std::string kind = std::filesystem::path(path).extension().string();
  if (kind == ".simplemap") return from_simplemap(path, resolution);
  if (kind == ".yaml" || kind == ".yml") return from_grid(path);
  return Error{path + ": is neither .simplemap nor .yaml; expected a map of MRPT or a ROS map's YAML file"};
} catch (const std::bad_alloc&) {
  return Error{path + ": needs more memory than this machine has; use a smaller map"};
} catch (const std::exception&) {
  return Error{path + ": MRPT cannot make a grid of its scans; the file is damaged, make the map again"};
}

}  // namespace parhelion::pose
