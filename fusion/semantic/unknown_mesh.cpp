#include "fusion/semantic/unknown_mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>
#include <unordered_set>
#include <vector>

namespace parhelion::semantic {
namespace {

constexpr std::uint32_t kUnowned = ~std::uint32_t{0};
constexpr int kBits = 21;  ///< of a cube's index along one axis
constexpr std::int64_t kReach = std::int64_t{1} << (kBits - 1);
constexpr std::size_t kMaxTriangles = 900'000;  ///< independent of the area: a model file holds a million

using Index = std::array<std::int64_t, 3>;

std::uint64_t key_of(const Index& i) {
  std::uint64_t key = 0;
  for (const std::int64_t x : i) key = key << kBits | static_cast<std::uint64_t>(x + kReach);
  return key;
}

Index index_of(std::uint64_t key) {
  constexpr std::uint64_t mask = (std::uint64_t{1} << kBits) - 1;
  const auto part = [&](int shift) { return static_cast<std::int64_t>(key >> shift & mask) - kReach; };
  return {part(2 * kBits), part(kBits), part(0)};
}

struct Cube {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();  ///< of its points, m
  std::uint32_t points = 0;
  std::uint32_t owner = kUnowned, votes = 0;  ///< of most of its points (Boyer and Moore 1991)
  bool solid = false;

  void vote(std::uint32_t of) {
    if (votes == 0) owner = of;
    votes = owner == of ? votes + 1 : votes - 1;
  }
};

/// Indices wrap for points farther than a million cubes; such cubes count as absent.
Index neighbour(Index i, int axis, int step) {
  i[static_cast<std::size_t>(axis)] += step;
  return i;
}

class Mesher {
 public:
  Mesher(double cube, const UnknownMeshOptions& options) : cube_(cube), options_(options) {}

  bool add(const Eigen::Vector3f& point, std::uint32_t owner) {
    const Eigen::Vector3d p = point.cast<double>();
    Index i{};
    for (int axis = 0; axis < 3; ++axis) {
      const double at = std::floor(p[axis] / cube_);
      if (!(std::abs(at) < static_cast<double>(kReach - 2))) return false;
      i[static_cast<std::size_t>(axis)] = static_cast<std::int64_t>(at);
    }
    Cube& cube = cubes_[key_of(i)];
    cube.sum += p;
    ++cube.points;
    cube.vote(owner);
    return true;
  }

  /// Marks the cubes that stay solid; returns the points that are in no solid cube.
  std::uint64_t choose_solid();
  /// Two triangles per face.
  std::size_t count_triangles() const;
  /// m^2 of the plan, in squares of about a metre that hold a solid cube.
  double covered_plan() const;
  /// The faces of the cubes of each owner, in the order of the keys; those of no owner last.
  std::vector<ModelMesh> surfaces(std::size_t owners) const;

 private:
  bool solid(const Index& i) const {
    const auto found = cubes_.find(key_of(i));
    return found != cubes_.end() && found->second.solid;
  }
  std::vector<std::uint64_t> sorted_keys() const {
    std::vector<std::uint64_t> keys;
    keys.reserve(cubes_.size());
    for (const auto& [key, cube] : cubes_) keys.push_back(key);
    std::sort(keys.begin(), keys.end());
    return keys;
  }
  Eigen::Vector3f corner(const Index& i) const;

  double cube_;
  const UnknownMeshOptions& options_;
  std::unordered_map<std::uint64_t, Cube> cubes_;
};

std::uint64_t Mesher::choose_solid() {
  std::uint64_t left_out = 0;
  const std::vector<std::uint64_t> keys = sorted_keys();
  for (const std::uint64_t key : keys) cubes_[key].solid = cubes_[key].points >= options_.min_points;
  std::unordered_map<std::uint64_t, bool> visited;
  std::vector<std::uint64_t> group, open;
  for (const std::uint64_t key : keys) {
    if (!cubes_[key].solid || visited[key]) continue;
    group.clear();
    open = {key};
    visited[key] = true;
    while (!open.empty()) {
      const std::uint64_t at = open.back();
      open.pop_back();
      group.push_back(at);
      const Index i = index_of(at);
      for (int n = 0; n < 27; ++n) {
        const Index other{i[0] + n % 3 - 1, i[1] + n / 3 % 3 - 1, i[2] + n / 9 - 1};
        if (!solid(other) || visited[key_of(other)]) continue;
        visited[key_of(other)] = true;
        open.push_back(key_of(other));
      }
    }
    if (group.size() >= options_.min_cubes) continue;
    for (const std::uint64_t at : group) cubes_[at].solid = false;
  }
  for (const auto& [key, cube] : cubes_) left_out += cube.solid ? 0 : cube.points;
  return left_out;
}

std::size_t Mesher::count_triangles() const {
  std::size_t faces = 0;
  for (const auto& [key, cube] : cubes_) {
    if (!cube.solid) continue;
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) faces += solid(neighbour(index_of(key), axis, step)) ? 0 : 1;
    }
  }
  return 2 * faces;
}

double Mesher::covered_plan() const {
  const auto per_square = std::max<std::int64_t>(1, std::llround(1 / cube_));
  const auto square = [&](std::int64_t i) { return (i + kReach) / per_square; };
  std::unordered_set<std::uint64_t> squares;
  for (const auto& [key, cube] : cubes_) {
    const Index i = index_of(key);
    if (cube.solid) squares.insert(static_cast<std::uint64_t>(square(i[0]) << kBits | square(i[1])));
  }
  const double side = static_cast<double>(per_square) * cube_;
  return side * side * static_cast<double>(squares.size());
}

/// The corner at the low end of cube `i`, moved towards the points around it; by at most 0.4 of a cube, so
/// that no face folds over.
Eigen::Vector3f Mesher::corner(const Index& i) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::uint32_t points = 0;
  for (int n = 0; n < 8; ++n) {
    const auto found = cubes_.find(key_of({i[0] - (n & 1), i[1] - (n >> 1 & 1), i[2] - (n >> 2)}));
    if (found == cubes_.end() || !found->second.solid) continue;
    sum += found->second.sum;
    points += found->second.points;
  }
  const Eigen::Vector3d at = cube_ * Eigen::Vector3d(static_cast<double>(i[0]), static_cast<double>(i[1]),
                                                     static_cast<double>(i[2]));
  if (points == 0) return at.cast<float>();
  const double limit = 0.4 * cube_;
  return (at + (sum / points - at).cwiseMax(-limit).cwiseMin(limit)).cast<float>();
}

std::vector<ModelMesh> Mesher::surfaces(std::size_t owners) const {
  std::vector<ModelMesh> meshes(owners + 1);
  std::vector<std::unordered_map<std::uint64_t, std::uint32_t>> vertices(owners + 1);
  for (const std::uint64_t key : sorted_keys()) {
    const Cube& cube = cubes_.at(key);
    if (!cube.solid) continue;
    const std::size_t owner = std::min<std::size_t>(cube.owner, owners);
    ModelMesh& mesh = meshes[owner];
    const auto vertex = [&](const Index& i) {
      const auto [entry, is_new] =
          vertices[owner].emplace(key_of(i), static_cast<std::uint32_t>(mesh.vertices.size()));
      if (is_new) mesh.vertices.push_back(corner(i));
      return entry->second;
    };
    const Index i = index_of(key);
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        if (solid(neighbour(i, axis, step))) continue;
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        const Index a = neighbour(i, axis, step > 0 ? 1 : 0);
        const std::array<std::uint32_t, 4> quad{vertex(a), vertex(neighbour(a, u, 1)),
                                                vertex(neighbour(neighbour(a, u, 1), v, 1)),
                                                vertex(neighbour(a, v, 1))};
        const bool out = step > 0;
        mesh.triangles.push_back({quad[0], quad[out ? 1 : 2], quad[out ? 2 : 1]});
        mesh.triangles.push_back({quad[0], quad[out ? 2 : 3], quad[out ? 3 : 2]});
      }
    }
  }
  return meshes;
}

}  // namespace

Result<UnknownMesh> unknown_mesh(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels,
                                 const UnknownMeshOptions& options, std::span<const std::uint32_t> owner_of,
                                 std::size_t owners) {
  if (labels.size() != cloud.size()) {
    return Error{"mesh of unknown objects: " + std::to_string(labels.size()) + " labels for " +
                 std::to_string(cloud.size()) + " points"};
  }
  if (!(options.cube > 0 && options.cube <= 10) || options.max_triangles < 100 ||
      !(options.triangles_per_m2 >= 0))
    return Error{"mesh of unknown objects: expected 0 m < cube <= 10 m and at least 100 triangles"};
  for (double cube = options.cube;; cube *= 1.25) {
    Mesher mesher(cube, options);
    UnknownMesh result;
    result.cube = cube;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const std::uint32_t owner = owner_of.empty() ? kUnowned : owner_of[i];
      if (labels[i] == static_cast<std::uint8_t>(EntityLabel::unknown) && !mesher.add(cloud.points[i], owner))
        ++result.left_out;
    }
    result.left_out += mesher.choose_solid();
    const auto by_area = static_cast<std::size_t>(options.triangles_per_m2 * mesher.covered_plan());
    const std::size_t limit = std::max(options.max_triangles, std::min(by_area, kMaxTriangles));
    if (mesher.count_triangles() > limit) continue;
    result.of_owner = mesher.surfaces(owners);
    result.mesh = std::move(result.of_owner.back());
    result.mesh.name = "unknown";
    result.of_owner.pop_back();
    return result;
  }
}

}  // namespace parhelion::semantic
