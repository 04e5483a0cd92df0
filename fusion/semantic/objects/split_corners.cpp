#include "fusion/semantic/objects/split_corners.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <utility>

#include "fusion/semantic/objects/plan_rectangle.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

using Cubes = std::vector<std::uint32_t>;

constexpr double kLong = 1.2, kBroad = 0.8;  ///< m, of what may be more than one thing
constexpr double kLongest = 12;              ///< m, of furniture in a row; more is no room's
constexpr double kStep = 0.1;                ///< m, between cuts that are tried
constexpr double kArm = 0.3, kReach = 0.6;   ///< m, breadth and length of a piece
constexpr double kSmaller = 0.65;            ///< of the box's area, that of the pieces' boxes together

/// One or two straight cuts along a normal.
struct Cuts {
  Eigen::Vector2d normal = Eigen::Vector2d::Zero();
  std::vector<double> at;  ///< m along the normal, ascending

  std::size_t piece_of(const Eigen::Vector2d& p) const {
    return static_cast<std::size_t>(std::upper_bound(at.begin(), at.end(), normal.dot(p)) - at.begin());
  }
};

std::vector<Eigen::Vector2d> columns_of(const ObjectGrid& grid, const Cubes& cubes) {
  std::vector<Eigen::Vector2d> columns;
  for (const std::uint32_t c : cubes) columns.push_back(grid.plan(c));
  const auto before = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y());
  };
  std::sort(columns.begin(), columns.end(), before);
  columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
  return columns;
}

/// The extent of most points along a direction, m.
double extent(const std::vector<Eigen::Vector2d>& points, const Eigen::Vector2d& direction, double cell) {
  if (points.empty()) return 0;
  std::vector<double> along(points.size());
  std::transform(points.begin(), points.end(), along.begin(),
                 [&](const Eigen::Vector2d& p) { return direction.dot(p); });
  const auto [low, high] = quantile_range(along, 0.02, 0.98);
  return high - low + cell;
}

/// m, the usual extent of the slices across a piece.
double breadth(const std::vector<Eigen::Vector2d>& points, const Eigen::Vector2d& across, double cell) {
  const Eigen::Vector2d along(across.y(), -across.x());
  std::map<long, std::pair<double, double>> slices;
  for (const Eigen::Vector2d& p : points) {
    const double t = across.dot(p);
    const auto [slice, is_new] = slices.try_emplace(std::lround(along.dot(p) / cell), t, t);
    if (!is_new) slice->second = {std::min(slice->second.first, t), std::max(slice->second.second, t)};
  }
  std::vector<double> breadths;
  for (const auto& [at, range] : slices) breadths.push_back(range.second - range.first + cell);
  return breadths.empty() ? 0 : quantile(breadths, 0.5);
}

/// m^2 of the boxes of all pieces; nothing where it is not less than `limit`, or where a piece is too small
/// or too thin to be a thing.
std::optional<double> area_after(const std::vector<Eigen::Vector2d>& columns, const Cuts& cuts, double cell,
                                 double limit) {
  const Eigen::Vector2d &along = cuts.normal, across(-along.y(), along.x());
  std::vector<std::vector<Eigen::Vector2d>> pieces(cuts.at.size() + 1);
  for (const Eigen::Vector2d& p : columns) pieces[cuts.piece_of(p)].push_back(p);
  double area = 0;
  std::vector<bool> is_long;
  for (const auto& piece : pieces) {
    const double s = extent(piece, along, cell), t = extent(piece, across, cell);
    area += s * t;
    if (std::max(s, t) < kReach || area >= limit) return std::nullopt;
    is_long.push_back(s > t);
  }
  // Last, as few cuts get here.
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    if (breadth(pieces[k], is_long[k] ? across : along, cell) < kArm) return std::nullopt;
  }
  return area;
}

/// The cuts after which the boxes of the pieces are smallest.
class Search {
 public:
  Search(const std::vector<Eigen::Vector2d>& columns, double cell)
      : columns_(columns), cell_(cell), box_(plan_rectangle(columns, cell)) {}

  /// Nothing where the boxes of pieces are hardly smaller than the one of all.
  std::optional<Cuts> find() {
    if (box_.length < kLong || box_.width < kBroad || box_.length > kLongest) return std::nullopt;
    best_ = kSmaller * box_.length * box_.width;
    constexpr int kTurns = 30;  // of the half circle: the box of a corner may lie across it
    for (int k = 0; k < kTurns; ++k) try_one(EIGEN_PI * k / kTurns);
    if (!found_) try_two(box_.yaw), try_two(box_.yaw + 0.5 * EIGEN_PI);
    return found_;
  }

 private:
  /// Where a cut leaves room for a piece on either side.
  std::vector<double> places(const Eigen::Vector2d& normal) const {
    std::vector<double> at;
    const double middle = normal.dot(box_.middle), reach = 0.5 * extent(columns_, normal, cell_) - kArm;
    for (double place = middle - reach; place <= middle + reach; place += kStep) at.push_back(place);
    return at;
  }
  void weigh(Cuts cuts) {
    const auto area = area_after(columns_, cuts, cell_, best_);
    if (area) best_ = *area, found_ = std::move(cuts);
  }
  void try_one(double yaw) {
    const Eigen::Vector2d normal(std::cos(yaw), std::sin(yaw));
    for (const double at : places(normal)) weigh({normal, {at}});
  }
  /// Both ends of a row around two corners: after one cut alone the boxes are as large as before.
  void try_two(double yaw) {
    const Eigen::Vector2d normal(std::cos(yaw), std::sin(yaw));
    for (const double first : places(normal)) {
      for (const double second : places(normal)) {
        if (second > first + kArm) weigh({normal, {first, second}});
      }
    }
  }

  const std::vector<Eigen::Vector2d>& columns_;
  double cell_;
  PlanRectangle box_;
  double best_ = 0;
  std::optional<Cuts> found_;
};

}  // namespace

std::vector<Cubes> split_corners(const ObjectGrid& grid, Cubes cubes) {
  std::vector<Cubes> open{std::move(cubes)}, parts;
  while (!open.empty()) {
    const Cubes part = std::move(open.back());
    open.pop_back();
    const std::vector<Eigen::Vector2d> columns = columns_of(grid, part);
    const auto cuts = Search(columns, grid.cell()).find();
    if (!cuts) {
      parts.push_back(part);
      continue;
    }
    std::vector<Cubes> pieces(cuts->at.size() + 1);
    for (const std::uint32_t c : part) pieces[cuts->piece_of(grid.plan(c))].push_back(c);
    std::move(pieces.begin(), pieces.end(), std::back_inserter(open));
  }
  return parts;
}

}  // namespace parhelion::semantic
