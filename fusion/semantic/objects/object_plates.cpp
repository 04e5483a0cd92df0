#include "fusion/semantic/objects/object_plates.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace parhelion::semantic {
namespace {

constexpr double kFree = 0.12;   ///< m, over a top
constexpr double kSame = 0.06;   ///< m, between neighbours of one top
constexpr double kLevel = 0.05;  ///< m, of its heights about their mean
constexpr int kAround = 6;       ///< of the nine columns around a cube that have a top at its height
constexpr int kReach = 2;        ///< columns: what lies on a table leaves holes in its top
constexpr double kFoot = 0.12;   ///< m, over the floor and under the top: not asked
constexpr double kFilled = 0.4;  ///< of the cubes between

class Plates {
 public:
  explicit Plates(const ObjectGrid& grid)
      : grid_(grid), flat_(grid.cubes().size()), done_(grid.cubes().size()) {
    std::vector<bool> top(grid.cubes().size());
    for (std::uint32_t c = 0; c < top.size(); ++c) top[c] = is_top(c);
    for (std::uint32_t c = 0; c < top.size(); ++c) flat_[c] = top[c] && is_flat(c, top);
  }

  std::vector<ObjectPlate> find(double min_area) {
    std::vector<ObjectPlate> plates;
    const double square = grid_.cell() * grid_.cell();
    for (std::uint32_t c = 0; c < flat_.size(); ++c) {
      if (!flat_[c] || done_[c]) continue;
      ObjectPlate plate = grown(c);
      plate.area = square * static_cast<double>(plate.cubes.size());
      if (plate.area < min_area) continue;
      plate.sides = sides_of(plate);
      plates.push_back(std::move(plate));
    }
    std::stable_sort(plates.begin(), plates.end(),
                     [](const ObjectPlate& a, const ObjectPlate& b) { return a.area > b.area; });
    return plates;
  }

 private:
  bool is_top(std::uint32_t c) const {
    const ObjectCube& cube = grid_.cubes()[c];
    const std::uint32_t next = c + 1;
    if (next >= grid_.cubes().size() || grid_.cubes()[next].at.head<2>() != cube.at.head<2>()) return true;
    return static_cast<double>(grid_.cubes()[next].z - cube.z) > kFree;
  }
  bool is_flat(std::uint32_t c, const std::vector<bool>& top) const {
    int around = 0;
    for_each_near(c, 1, [&](std::uint32_t other) { around += top[other]; });
    return around >= kAround - 1;  // itself is not among them
  }
  /// visit(cube) for cubes of the columns around with about the same height.
  template <class Visit>
  void for_each_near(std::uint32_t c, int reach, Visit&& visit) const {
    const ObjectCube& cube = grid_.cubes()[c];
    for (int dy = -reach; dy <= reach; ++dy) {
      for (int dx = -reach; dx <= reach; ++dx) {
        if (dx == 0 && dy == 0) continue;
        const auto [first, last] = grid_.column(cube.at.x() + dx, cube.at.y() + dy);
        for (std::uint32_t o = first; o < last; ++o) {
          if (std::abs(static_cast<double>(grid_.cubes()[o].z - cube.z)) < kSame) visit(o);
        }
      }
    }
  }
  ObjectPlate grown(std::uint32_t first) {
    ObjectPlate plate;
    plate.cubes = {first};
    done_[first] = true;
    double sum = static_cast<double>(grid_.cubes()[first].z);
    for (std::size_t k = 0; k < plate.cubes.size(); ++k) {
      for_each_near(plate.cubes[k], kReach, [&](std::uint32_t o) {
        const auto z = static_cast<double>(grid_.cubes()[o].z);
        if (done_[o] || !flat_[o] || std::abs(z - sum / static_cast<double>(plate.cubes.size())) > kLevel)
          return;
        done_[o] = true;
        plate.cubes.push_back(o);
        sum += z;
      });
    }
    std::vector<double> heights;
    for (const std::uint32_t c : plate.cubes) heights.push_back(grid_.height(c));
    std::nth_element(heights.begin(), heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2),
                     heights.end());
    plate.height = heights[heights.size() / 2];
    plate.z = sum / static_cast<double>(plate.cubes.size());
    return plate;
  }
  /// Whether the column, or one beside it, is filled from the floor to the plate.
  bool is_filled(int x, int y, const ObjectPlate& plate) const {
    const auto [first, last] = grid_.column(x, y);
    double filled = 0;
    for (std::uint32_t c = first; c < last; ++c) {
      const double height = grid_.height(c);
      filled += height > kFoot && height < plate.height - kFoot ? 1 : 0;
    }
    return filled * grid_.cell() > kFilled * std::max(0.1, plate.height - 2 * kFoot);
  }
  double sides_of(const ObjectPlate& plate) const {
    std::vector<std::pair<int, int>> inside;
    for (const std::uint32_t c : plate.cubes)
      inside.emplace_back(grid_.cubes()[c].at.x(), grid_.cubes()[c].at.y());
    std::sort(inside.begin(), inside.end());
    inside.erase(std::unique(inside.begin(), inside.end()), inside.end());
    int rim = 0, filled = 0;
    for (const auto& [x, y] : inside) {
      bool edge = false, closed = false;
      for (const auto& [dx, dy] : {std::pair{0, 0}, {1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        edge = edge || !std::binary_search(inside.begin(), inside.end(), std::pair(x + dx, y + dy));
        closed = closed || is_filled(x + dx, y + dy, plate);
      }
      rim += edge, filled += edge && closed;
    }
    return rim > 0 ? static_cast<double>(filled) / rim : 0;
  }

  const ObjectGrid& grid_;
  std::vector<bool> flat_, done_;
};

}  // namespace

std::vector<ObjectPlate> find_plates(const ObjectGrid& grid, double min_area) {
  return Plates(grid).find(min_area);
}

}  // namespace parhelion::semantic
