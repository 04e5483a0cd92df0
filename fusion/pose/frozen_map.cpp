#include "fusion/pose/frozen_map.hpp"

#include <exception>
#include <filesystem>
#include <new>

#include "fusion/pose/mapped_scan.hpp"

namespace parhelion::pose {
namespace {

constexpr double kSearchResolution = 0.1;  ///< m

bool occupied(const GridMap& grid, int x, int y) {
  if (x < 0 || y < 0 || x >= grid.width || y >= grid.height) return false;
  return grid.occupied[static_cast<std::size_t>(y) * static_cast<std::size_t>(grid.width) +
                       static_cast<std::size_t>(x)] > 0.65F;
}

/// Centres of the occupied cells visible to a laser: those with a free or unknown neighbour.
std::vector<Eigen::Vector2d> surface(const GridMap& grid) {
  std::vector<Eigen::Vector2d> points;
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      if (!occupied(grid, x, y)) continue;
      const bool inside = occupied(grid, x - 1, y) && occupied(grid, x + 1, y) && occupied(grid, x, y - 1) &&
                          occupied(grid, x, y + 1);
      if (!inside)
        points.emplace_back(grid.x_min + (x + 0.5) * grid.resolution,
                            grid.y_min + (y + 0.5) * grid.resolution);
    }
  }
  return points;
}

Result<FrozenMap> from_simplemap(const std::string& path, double resolution) {
  auto scans = read_simplemap(path);
  if (!scans) return scans.error();
  FrozenMap map;
  std::vector<Eigen::Vector2d> all;
  for (const MappedScan& scan : *scans) {
    const std::vector<Eigen::Vector2d> points = points_of(scan);
    map.fine.add(points, scan.T_map_base);
    map.coarse.add(points, scan.T_map_base);
    for (const Eigen::Vector2d& p : points) all.push_back(scan.T_map_base * p);
  }
  map.likelihood = CorrelativeMap(all, kSearchResolution);
  const std::string beside = std::filesystem::path(path).replace_extension(".yaml").string();
  std::error_code ignored;
  if (std::filesystem::exists(beside, ignored)) {
    auto grid = load_ros_map(beside);
    if (!grid) return grid.error();
    map.grid = std::move(*grid);
  } else {
    map.grid = grid_of(*scans, resolution);
  }
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
  map.fine.add(points, {});
  map.coarse.add(points, {});
  map.likelihood = CorrelativeMap(points, std::max(kSearchResolution, grid->resolution));
  map.sigma = grid->resolution / 2;
  map.grid = std::move(*grid);
  return map;
}

}  // namespace

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
