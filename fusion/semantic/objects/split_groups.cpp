#include "fusion/semantic/objects/split_groups.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "fusion/semantic/objects/split_corners.hpp"

namespace parhelion::semantic {
namespace {

using Cubes = std::vector<std::uint32_t>;
using Column = std::pair<int, int>;

constexpr double kSeatLow = 0.34, kSeatHigh = 0.56;     ///< m over the floor
constexpr double kSeatLeast = 0.06, kSeatMost = 0.36;   ///< m^2
constexpr double kSeatReach = 0.42, kChairHigh = 1.25;  ///< m, of a chair around its seat's middle
constexpr double kWide = 0.95;                          ///< m, of what is more than one chair
constexpr double kAlike = 0.10;                         ///< m, between the tops of neighbouring columns
constexpr double kRegion = 0.05, kLong = 0.4;           ///< m^2, m, of a stretch of one height
constexpr double kHigher = 0.35;                        ///< m, between two of them
constexpr double kRest = 0.6, kBack = 1.25;             ///< m: a seat or mattress, and the back of it

struct Seat {
  Eigen::Vector2d middle;
  double height;
};

Eigen::AlignedBox2d plan_of(const ObjectGrid& grid, const Cubes& cubes) {
  Eigen::AlignedBox2d box;
  for (const std::uint32_t c : cubes) box.extend(grid.plan(c));
  return box;
}

std::vector<Seat> seats_in(const ObjectGrid& grid, const std::vector<ObjectPlate>& plates,
                           const std::vector<std::uint32_t>& group_of, std::uint32_t group) {
  std::vector<Seat> seats;
  for (const ObjectPlate& plate : plates) {
    if (plate.height < kSeatLow || plate.height > kSeatHigh || plate.area < kSeatLeast ||
        plate.area > kSeatMost || group_of[plate.cubes.front()] != group)
      continue;
    const Eigen::AlignedBox2d box = plan_of(grid, plate.cubes);
    if (box.sizes().maxCoeff() > 0.7) continue;
    seats.push_back({box.center(), plate.height});
  }
  return seats;
}

/// Each cube to the seat that it is nearest to; the last part: to none.
std::vector<Cubes> split_at_seats(const ObjectGrid& grid, const Cubes& cubes,
                                  const std::vector<Seat>& seats) {
  std::vector<Cubes> parts(seats.size() + 1);
  for (const std::uint32_t c : cubes) {
    std::size_t best = seats.size();
    double nearest = kSeatReach;
    for (std::size_t s = 0; s < seats.size(); ++s) {
      const double away = (grid.plan(c) - seats[s].middle).cwiseAbs().maxCoeff();
      if (away < nearest && grid.height(c) < kChairHigh) nearest = away, best = s;
    }
    parts[best].push_back(c);
  }
  std::erase_if(parts, [](const Cubes& part) { return part.empty(); });
  return parts;
}

struct Region {
  std::vector<std::size_t> columns;
  double top = 0;  ///< m over the floor
  Eigen::AlignedBox2d box;
};

class Heights {
 public:
  Heights(const ObjectGrid& grid, const Cubes& cubes) : grid_(grid) {
    for (const std::uint32_t c : cubes) columns_.push_back(column_of(c));
    std::sort(columns_.begin(), columns_.end());
    columns_.erase(std::unique(columns_.begin(), columns_.end()), columns_.end());
    tops_.assign(columns_.size(), 0);
    for (const std::uint32_t c : cubes) {
      double& top = tops_[find(column_of(c))];
      top = std::max(top, grid.height(c));
    }
    find_regions();
  }
  /// Whether it is more than one piece of furniture.
  bool differ() const {
    for (const Region& a : regions_) {
      for (const Region& b : regions_) {
        const bool back =
            a.top < kRest && b.top < kBack && std::min(b.box.sizes().x(), b.box.sizes().y()) < 0.4;
        if (b.top > a.top + kHigher && !back) return true;
      }
    }
    return false;
  }
  std::vector<Cubes> split(const Cubes& cubes) {
    std::vector<std::size_t> region_of(columns_.size(), regions_.size()), open;
    for (std::size_t r = 0; r < regions_.size(); ++r) {
      for (const std::size_t column : regions_[r].columns) region_of[column] = r, open.push_back(column);
    }
    for (std::size_t k = 0; k < open.size(); ++k) {
      const std::size_t at = open[k];
      for_each_around(at, [&](std::size_t next) {
        if (region_of[next] < regions_.size()) return;
        region_of[next] = region_of[at];
        open.push_back(next);
      });
    }
    std::vector<Cubes> parts(regions_.size() + 1);
    for (const std::uint32_t c : cubes) parts[region_of[find(column_of(c))]].push_back(c);
    std::erase_if(parts, [](const Cubes& part) { return part.empty(); });
    return parts;
  }

 private:
  Column column_of(std::uint32_t cube) const {
    return {grid_.cubes()[cube].at.x(), grid_.cubes()[cube].at.y()};
  }
  /// The place of a column that is there.
  std::size_t find(const Column& column) const {
    return static_cast<std::size_t>(std::lower_bound(columns_.begin(), columns_.end(), column) -
                                    columns_.begin());
  }
  /// visit(place) for the columns at and around one, by y, then x.
  template <class Visit>
  void for_each_around(std::size_t place, Visit&& visit) const {
    const auto [x, y] = columns_[place];
    for (int n = 0; n < 9; ++n) {
      const Column next{x + n % 3 - 1, y + n / 3 - 1};
      const std::size_t at = find(next);
      if (at < columns_.size() && columns_[at] == next) visit(at);
    }
  }

  void find_regions() {
    std::vector<bool> seen(columns_.size());
    for (std::size_t first = 0; first < columns_.size(); ++first) {
      if (seen[first]) continue;
      const double top = tops_[first];
      Region region;
      region.columns = {first};
      seen[first] = true;
      for (std::size_t k = 0; k < region.columns.size(); ++k) {
        const auto [x, y] = columns_[region.columns[k]];
        region.box.extend(grid_.cell() * Eigen::Vector2d(x, y));
        region.box.extend(grid_.cell() * Eigen::Vector2d(x + 1, y + 1));
        for_each_around(region.columns[k], [&](std::size_t next) {
          if (seen[next] || std::abs(tops_[next] - top) > kAlike) return;
          seen[next] = true;
          region.columns.push_back(next);
        });
      }
      region.top = top;
      const double area = grid_.cell() * grid_.cell() * static_cast<double>(region.columns.size());
      if (area > kRegion && region.box.sizes().maxCoeff() > kLong) regions_.push_back(std::move(region));
    }
  }
  const ObjectGrid& grid_;
  std::vector<Column> columns_;  ///< ascending
  std::vector<double> tops_;     ///< m over the floor, of these
  std::vector<Region> regions_;
};

}  // namespace

std::vector<Cubes> split_groups(const ObjectGrid& grid, const std::vector<ObjectPlate>& plates,
                                std::vector<Cubes> groups) {
  std::vector<std::uint32_t> group_of(grid.cubes().size(), kNone);
  for (std::uint32_t g = 0; g < groups.size(); ++g) {
    for (const std::uint32_t c : groups[g]) group_of[c] = g;
  }
  std::vector<std::vector<Cubes>> parts_of(groups.size());
  tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(groups.size()), [&](std::uint32_t g) {
    const std::vector<Seat> seats = seats_in(grid, plates, group_of, g);
    const bool wide = plan_of(grid, groups[g]).sizes().maxCoeff() > kWide;
    std::vector<Cubes> by_seat =
        !seats.empty() && wide ? split_at_seats(grid, groups[g], seats) : std::vector<Cubes>{groups[g]};
    for (Cubes& part : by_seat) {
      Heights heights(grid, part);
      for (Cubes& row : heights.differ() ? heights.split(part) : std::vector<Cubes>{part}) {
        for (Cubes& piece : split_corners(grid, std::move(row))) parts_of[g].push_back(std::move(piece));
      }
    }
  });
  std::vector<Cubes> parts;
  for (std::vector<Cubes>& of_group : parts_of)
    std::move(of_group.begin(), of_group.end(), std::back_inserter(parts));
  return parts;
}

}  // namespace parhelion::semantic
