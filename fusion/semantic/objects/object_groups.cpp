#include "fusion/semantic/objects/object_groups.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "fusion/semantic/objects/split_groups.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kLowest = 0.05;  ///< m over the floor: less is the floor's noise
constexpr double kTableLow = 0.3, kTableHigh = 1.3, kTableArea = 0.28;  ///< m, m, m^2
constexpr double kClosed = 0.3;     ///< of a plate's rim: a counter, a chest, a bed
constexpr double kRim = 0.08;       ///< m about the plate: its edge
constexpr double kLeg = 0.7;        ///< of a leg's height that is measured
constexpr std::size_t kSmall = 12;  ///< cubes of a fragment
constexpr double kNear = 0.2;       ///< m, from a fragment to what it is a part of
constexpr double kStacked = 0.35, kOver = 0.7, kTallest = 2.3;  ///< m, fraction of the cubes, m

using Column = std::pair<int, int>;  ///< y, x

void sort_unique(std::vector<Column>& columns) {
  std::sort(columns.begin(), columns.end());
  columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
}

/// Numbered boxes by the cells of the plan that they reach into.
class BoxesInPlan {
 public:
  void add(std::size_t number, const Eigen::AlignedBox3d& box) {
    for_each_cell(box, [&](std::uint64_t cell) { cells_[cell].push_back(number); });
  }
  /// All whose boxes meet this one in the plan, and some that are near; ascending.
  std::vector<std::size_t> near(const Eigen::AlignedBox3d& box) const {
    std::vector<std::size_t> numbers;
    for_each_cell(box, [&](std::uint64_t cell) {
      if (const auto found = cells_.find(cell); found != cells_.end())
        numbers.insert(numbers.end(), found->second.begin(), found->second.end());
    });
    std::sort(numbers.begin(), numbers.end());
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
    return numbers;
  }

 private:
  template <class Visit>
  static void for_each_cell(const Eigen::AlignedBox3d& box, Visit&& visit) {
    constexpr double kSide = 1;  // m
    const Eigen::Array2i first = (box.min().head<2>().array() / kSide).floor().cast<int>();
    const Eigen::Array2i last = (box.max().head<2>().array() / kSide).floor().cast<int>();
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x)
        visit(std::uint64_t{static_cast<std::uint32_t>(y)} << 32 | static_cast<std::uint32_t>(x));
    }
  }
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> cells_;
};

class Grouping {
 public:
  Grouping(const ObjectGrid& grid, const std::vector<ObjectPlate>& plates)
      : grid_(grid), plates_(plates), taken_(grid.cubes().size()) {
    for (std::uint32_t c = 0; c < taken_.size(); ++c) taken_[c] = grid.height(c) < kLowest;
  }

  std::vector<ObjectGroup> find() {
    for (const ObjectPlate& plate : plates_) {
      if (plate.height > kTableLow && plate.height < kTableHigh && plate.area > kTableArea &&
          plate.sides < kClosed)
        lift_table(plate);
    }
    const std::size_t tables = groups_.size();
    for (std::vector<std::uint32_t>& part : split_groups(grid_, plates_, components()))
      groups_.push_back({std::move(part), false});
    join_fragments(tables);
    join_stacks(tables);
    std::erase_if(groups_, [](const ObjectGroup& group) { return group.cubes.empty(); });
    for (ObjectGroup& group : groups_) std::sort(group.cubes.begin(), group.cubes.end());
    return std::move(groups_);
  }

 private:
  void claim(std::uint32_t c, ObjectGroup& group) {
    if (taken_[c]) return;
    taken_[c] = true;
    group.cubes.push_back(c);
  }

  /// The plate, its edge, and legs that reach from it to the floor.
  void lift_table(const ObjectPlate& plate) {
    ObjectGroup table;
    table.table = true;
    std::vector<Column> columns;
    for (const std::uint32_t c : plate.cubes) {
      if (taken_[c]) return;  // a part of a larger one
      const Eigen::Vector3i& at = grid_.cubes()[c].at;
      for (int k = 0; k < 9; ++k) columns.emplace_back(at.y() + k / 3 - 1, at.x() + k % 3 - 1);
    }
    sort_unique(columns);
    for (const auto& [y, x] : columns) {
      const auto [first, last] = grid_.column(x, y);
      double under = 0;
      for (std::uint32_t c = first; c < last; ++c) {
        const double over = static_cast<double>(grid_.cubes()[c].z) - plate.z;
        if (std::abs(over) < kRim) claim(c, table);
        under += over < -kRim && grid_.height(c) > kLowest ? grid_.cell() : 0;
      }
      if (under < kLeg * (plate.height - kRim - kLowest)) continue;
      for (std::uint32_t c = first; c < last; ++c) {
        if (static_cast<double>(grid_.cubes()[c].z) < plate.z) claim(c, table);
      }
    }
    groups_.push_back(std::move(table));
  }

  /// Cubes that touch, of what is left.
  std::vector<std::vector<std::uint32_t>> components() {
    std::vector<std::vector<std::uint32_t>> parts;
    for (std::uint32_t first = 0; first < taken_.size(); ++first) {
      if (taken_[first]) continue;
      std::vector<std::uint32_t> part{first};
      taken_[first] = true;
      for (std::size_t k = 0; k < part.size(); ++k) {
        const Eigen::Vector3i at = grid_.cubes()[part[k]].at;
        for (int n = 0; n < 9; ++n) {
          const auto [begin, end] = grid_.column(at.x() + n % 3 - 1, at.y() + n / 3 - 1);
          for (std::uint32_t c = begin; c < end; ++c) {
            // A gap of one cube upwards: scans' lines are farther apart there.
            if (taken_[c] || std::abs(grid_.cubes()[c].at.z() - at.z()) > 2) continue;
            taken_[c] = true;
            part.push_back(c);
          }
        }
      }
      parts.push_back(std::move(part));
    }
    return parts;
  }

  Eigen::AlignedBox3d box_of(const ObjectGroup& group) const {
    Eigen::AlignedBox3d box;
    for (const std::uint32_t c : group.cubes) {
      const Eigen::Vector3d low = grid_.cell() * grid_.cubes()[c].at.cast<double>();
      box.extend(low).extend(Eigen::Vector3d(low.array() + grid_.cell()));
    }
    return box;
  }
  std::vector<Eigen::AlignedBox3d> boxes() const {
    std::vector<Eigen::AlignedBox3d> result;
    for (const ObjectGroup& group : groups_) result.push_back(box_of(group));
    return result;
  }
  void merge(std::size_t from, std::size_t into) {
    std::vector<std::uint32_t>& a = groups_[into].cubes;
    a.insert(a.end(), groups_[from].cubes.begin(), groups_[from].cubes.end());
    groups_[from].cubes.clear();
  }

  /// A few cubes beside something larger are a part of it; under a table they are its legs' rest.
  void join_fragments(std::size_t tables) {
    const std::vector<Eigen::AlignedBox3d> box = boxes();
    BoxesInPlan large;  // what is joined to them does not change which they are
    for (std::size_t o = 0; o < groups_.size(); ++o) {
      if (groups_[o].cubes.size() >= 2 * kSmall) large.add(o, box[o]);
    }
    for (std::size_t g = tables; g < groups_.size(); ++g) {
      if (groups_[g].cubes.size() >= kSmall) continue;
      std::size_t best = groups_.size();
      double nearest = kNear;
      const Eigen::AlignedBox3d about(box[g].min().array() - kNear, box[g].max().array() + kNear);
      for (const std::size_t o : large.near(about)) {
        const double apart = box[o].exteriorDistance(box[g]);
        if (o < tables && box[g].min().z() > box[o].max().z() - kRim) continue;
        if (apart < nearest) nearest = apart, best = o;
      }
      if (best < groups_.size()) merge(g, best);
    }
  }

  std::vector<Column> columns_of(const ObjectGroup& group) const {
    std::vector<Column> columns;
    for (const std::uint32_t c : group.cubes)
      columns.emplace_back(grid_.cubes()[c].at.y(), grid_.cubes()[c].at.x());
    sort_unique(columns);
    return columns;
  }
  /// Fraction of a group's cubes that stand in the columns or within two of one.
  double fraction_about(const std::vector<Column>& columns, const ObjectGroup& group) const {
    const auto is_about = [&](int y, int x) {
      for (int row = y - 2; row <= y + 2; ++row) {
        const auto next = std::lower_bound(columns.begin(), columns.end(), Column{row, x - 2});
        if (next != columns.end() && *next <= Column{row, x + 2}) return true;
      }
      return false;
    };
    std::size_t inside = 0;
    for (const std::uint32_t c : group.cubes) {
      const Eigen::Vector3i& at = grid_.cubes()[c].at;
      inside += is_about(at.y(), at.x());
    }
    return static_cast<double>(inside) / static_cast<double>(group.cubes.size());
  }

  /// Pieces over one another that a scan's gap parts.
  void join_stacks(std::size_t tables) {
    std::vector<Eigen::AlignedBox3d> box = boxes();
    std::vector<std::vector<Column>> columns(groups_.size());
    BoxesInPlan standing;
    for (std::size_t g = tables; g < groups_.size(); ++g) {
      if (!groups_[g].cubes.empty()) standing.add(g, box[g]);
    }
    for (std::size_t g = tables; g < groups_.size(); ++g) {
      if (groups_[g].cubes.empty()) continue;
      for (const std::size_t o : standing.near(box[g])) {
        if (o == g || groups_[o].cubes.size() < groups_[g].cubes.size() || groups_[o].cubes.empty()) continue;
        const double gap = std::max(box[g].min().z() - box[o].max().z(), box[o].min().z() - box[g].max().z());
        const Eigen::AlignedBox3d all = box[g].merged(box[o]);
        if (gap > kStacked || all.sizes().z() > kTallest || !meet_in_plan(box[g], box[o])) continue;
        if (columns[o].empty()) columns[o] = columns_of(groups_[o]);
        if (fraction_about(columns[o], groups_[g]) < kOver) continue;
        merge(g, o);
        box[o] = all;
        standing.add(o, all);
        columns[o].clear();
        break;
      }
    }
  }

  static bool meet_in_plan(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) {
    return (a.min().head<2>().array() <= b.max().head<2>().array()).all() &&
           (b.min().head<2>().array() <= a.max().head<2>().array()).all();
  }

  const ObjectGrid& grid_;
  const std::vector<ObjectPlate>& plates_;
  std::vector<bool> taken_;
  std::vector<ObjectGroup> groups_;
};

}  // namespace

std::vector<ObjectGroup> find_groups(const ObjectGrid& grid, const std::vector<ObjectPlate>& plates) {
  return Grouping(grid, plates).find();
}

}  // namespace parhelion::semantic
