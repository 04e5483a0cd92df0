#include "fusion/semantic/carrier_points.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <tuple>

#include "fusion/cloud/parallel.hpp"
#include "protocols/model.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kCube = 0.1;           // m
constexpr double kCarrier = 1.0;        // m, in the plan, from the viewpoint
constexpr double kAround = 1.2;         // m: distance within which the carrier is connected
constexpr double kHigher = 0.2;         // m, over the viewpoint
constexpr double kScanner = 0.3;        // m, from the viewpoint
constexpr double kBehind = 0.2;         // m, from an object to the end of a line of sight through it
constexpr double kSight = 15;           // m, of a line of sight
constexpr double kLookedThrough = 0.5;  // fraction of an object's cubes

using Index = std::tuple<int, int, int>;

Index cube_of(const Eigen::Vector3f& p) {
  const auto at = [](float v) { return static_cast<int>(std::floor(v / kCube)); };
  return {at(p.x()), at(p.y()), at(p.z())};
}

/// Viewpoints by plan cells of kAround.
class NearViewpoints {
 public:
  explicit NearViewpoints(const std::vector<Eigen::Vector3d>& viewpoints) : viewpoints_(viewpoints) {
    for (std::uint32_t v = 0; v < viewpoints.size(); ++v)
      cells_[{cell(viewpoints[v].x()), cell(viewpoints[v].y())}].push_back(v);
  }
  bool any(const Eigen::Vector3f& p) const {
    const int x = cell(p.x()), y = cell(p.y());
    for (int k = 0; k < 9; ++k) {
      const auto found = cells_.find({x + k % 3 - 1, y + k / 3 - 1});
      if (found == cells_.end()) continue;
      for (const std::uint32_t v : found->second) {
        if ((viewpoints_[v].head<2>() - p.head<2>().cast<double>()).norm() <= kAround) return true;
      }
    }
    return false;
  }

 private:
  static int cell(double v) { return static_cast<int>(std::floor(v / kAround)); }
  const std::vector<Eigen::Vector3d>& viewpoints_;
  std::map<std::pair<int, int>, std::vector<std::uint32_t>> cells_;
};

struct Cube {
  std::vector<std::uint32_t> points;
  std::uint16_t view = 0;
  bool alone = true;     ///< seen from one view only
  bool carried = false;  ///< may belong to the carrier of that view's scanner
  bool visited = false, looked_through = false;
};

/// Touching cubes that may belong to one carrier.
struct Thing {
  std::vector<Cube*> cubes;
  std::vector<Eigen::Vector3d> centres;
  std::uint16_t view = 0;
  bool joined = false;  ///< touches something that is not the carrier
  Eigen::AlignedBox3d bounds;
};

/// A thing as seen from one viewpoint.
struct Ahead {
  const Thing* thing;
  Eigen::Vector3d to_middle;  ///< m
  double radius;              ///< m
  double min_along;           ///< m^2: square of how far along a ray its middle is at least, where it is met

  /// Whether a ray towards `to_point` (m; `square`: of its length) may meet it: true for some that just miss,
  /// never false for one that meets it. Cheap, as the ray need not be of unit length; most rays miss.
  bool may_meet(const Eigen::Vector3d& to_point, double square) const {
    constexpr double rounding = 1e-6;  // m^2
    if (min_along <= rounding) return true;
    const double along = to_middle.dot(to_point);
    return along > 0 && along * along > (min_along - rounding) * square;
  }
};

class Carriers {
 public:
  Carriers(const cloud::PointCloud<Map>& cloud, const std::vector<std::uint8_t>& labels) : cloud_(cloud) {
    const NearViewpoints near(cloud.viewpoints);
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (labels[i] != static_cast<std::uint8_t>(EntityLabel::unknown) || !near.any(cloud.points[i]))
        continue;
      Cube& cube = cubes_[cube_of(cloud.points[i])];
      const std::uint16_t view = view_of(i);
      cube.alone = cube.alone && (cube.points.empty() || cube.view == view);
      cube.view = view;
      cube.points.push_back(static_cast<std::uint32_t>(i));
    }
    for (auto& [index, cube] : cubes_) cube.carried = may_be_carried(cube);
  }

  void drop(std::vector<std::uint8_t>& labels) {
    std::vector<Thing> things;
    for (auto& [index, cube] : cubes_) {
      if (cube.carried && !cube.visited) things.push_back(grown(index));
    }
    look_through(things);
    for (const Thing& thing : things) {
      const auto through = static_cast<double>(std::count_if(
          thing.cubes.begin(), thing.cubes.end(), [](const Cube* c) { return c->looked_through; }));
      const bool of_scanner = !thing.joined && within(thing, kScanner);
      if (through < kLookedThrough * static_cast<double>(thing.cubes.size()) && !of_scanner) continue;
      for (const Cube* cube : thing.cubes) {
        for (const std::uint32_t i : cube->points)
          labels[i] = static_cast<std::uint8_t>(EntityLabel::free_space);
      }
    }
  }

 private:
  std::uint16_t view_of(std::size_t i) const {
    return cloud_.scans.empty() ? std::uint16_t{0} : cloud_.scans[i];
  }

  Thing grown(const Index& first) {
    Thing thing;
    thing.view = cubes_.at(first).view;
    std::vector<Index> open{first};
    cubes_.at(first).visited = true;
    while (!open.empty()) {
      const auto [x, y, z] = open.back();
      open.pop_back();
      Cube& cube = cubes_.at({x, y, z});
      thing.cubes.push_back(&cube);
      thing.centres.push_back(kCube * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5));
      for (const std::uint32_t i : cube.points) thing.bounds.extend(cloud_.points[i].cast<double>());
      for (int n = 0; n < 27; ++n) {
        const auto found = cubes_.find({x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1});
        if (found == cubes_.end()) continue;
        if (!found->second.carried || found->second.view != thing.view) {
          thing.joined = true;
          continue;
        }
        if (found->second.visited) continue;
        found->second.visited = true;
        open.push_back(found->first);
      }
    }
    return thing;
  }

  /// Whether all of it is near the single viewpoint that saw it.
  bool may_be_carried(const Cube& cube) const {
    if (!cube.alone || cube.view >= cloud_.viewpoints.size()) return false;
    const Eigen::Vector3d& eye = cloud_.viewpoints[cube.view];
    return std::all_of(cube.points.begin(), cube.points.end(), [&](std::uint32_t i) {
      const Eigen::Vector3d p = cloud_.points[i].cast<double>();
      return p.z() <= eye.z() + kHigher && (p - eye).head<2>().norm() <= kCarrier;
    });
  }

  bool within(const Thing& thing, double reach) const {
    const Eigen::Vector3d& eye = cloud_.viewpoints[thing.view];
    for (const Cube* cube : thing.cubes) {
      for (const std::uint32_t i : cube->points) {
        if ((cloud_.points[i].cast<double>() - eye).norm() > reach) return false;
      }
    }
    return true;
  }

  /// Marks the cubes that a line of sight of another view passes.
  void look_through(const std::vector<Thing>& things) const {
    std::vector<std::vector<Ahead>> ahead(cloud_.viewpoints.size());
    for (std::size_t v = 0; v < ahead.size(); ++v) {
      for (const Thing& thing : things) {
        if (thing.view == v || thing.bounds.exteriorDistance(cloud_.viewpoints[v]) >= kSight) continue;
        const Eigen::Vector3d to_middle = thing.bounds.center() - cloud_.viewpoints[v];
        const double radius = 0.5 * thing.bounds.diagonal().norm() + kCube;
        ahead[v].push_back({&thing, to_middle, radius, to_middle.squaredNorm() - radius * radius});
      }
    }
    constexpr std::size_t kChunk = 16'384;
    cloud::for_each_chunk(cloud_.size(), kChunk, 0, [&](std::size_t, std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t view = view_of(i);
        if (view >= ahead.size() || ahead[view].empty()) continue;
        const Eigen::Vector3d &eye = cloud_.viewpoints[view],
                              to_point = cloud_.points[i].cast<double>() - eye;
        const double square = to_point.squaredNorm();
        for (const Ahead& thing : ahead[view]) {
          if (!thing.may_meet(to_point, square)) continue;
          const double length = to_point.norm();
          if (length > 0) pass(eye, to_point / length, length, thing);
        }
      }
    });
  }

  static void pass(const Eigen::Vector3d& eye, const Eigen::Vector3d& ray, double length,
                   const Ahead& ahead) {
    const double along = ahead.to_middle.dot(ray), radius = ahead.radius;
    if (along < 0 || along - radius > length ||
        (ahead.to_middle - along * ray).squaredNorm() > radius * radius)
      return;
    const Thing& thing = *ahead.thing;
    for (std::size_t c = 0; c < thing.cubes.size(); ++c) {
      const Eigen::Vector3d to_cube = thing.centres[c] - eye;
      const double at = to_cube.dot(ray);
      if (at < 0 || at + kBehind > length) continue;
      if ((to_cube - at * ray).squaredNorm() <= 0.25 * kCube * kCube)
        std::atomic_ref(thing.cubes[c]->looked_through).store(true, std::memory_order_relaxed);
    }
  }

  const cloud::PointCloud<Map>& cloud_;
  std::map<Index, Cube> cubes_;
};

}  // namespace

void drop_carriers(const cloud::PointCloud<Map>& cloud, std::vector<std::uint8_t>& labels) {
  if (!cloud.viewpoints.empty()) Carriers(cloud, labels).drop(labels);
}

}  // namespace parhelion::semantic
