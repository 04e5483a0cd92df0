#include "server/simulation/building/hazard_fields.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>

#include "protocols/line_in_box.hpp"
#include "server/simulation/building/building.hpp"
#include "server/simulation/building/doors.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNearest = 0.1;    // m: lower limit of the inverse-square law
constexpr double kMinWall = 0.005;  // m, minimum length of a line within a box
constexpr double kCell = 0.25;      // m
constexpr int kMaxCells = 250;  // along a side; with the longest reach, cells are still narrower than a door
constexpr double kBreath = 0.02;  // m: a gap narrower than twice this is closed to gas

/// Obstacles that block gas: not door leaves, nor anything overhead.
bool holds_gas(const FixedObstacle& obstacle) { return obstacle.label != EntityLabel::door; }

}  // namespace

Crossing crossing(const Building& building, const std::vector<Door>& doors, const Eigen::Vector3d& a,
                  const Eigen::Vector3d& b) {
  Crossing all;
  const auto count = [&](const Transform<Map, Body>& T_map_body, const Eigen::Vector3d& size) {
    const double within = line_in_box(T_map_body, size, a, b);
    if (within < kMinWall) return;
    ++all.walls;
    all.thickness += within;
  };
  const auto& states = building.states();
  const auto& definitions = building.definitions();
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (definitions[i]->moves) continue;
    for (const Shape& shape : definitions[i]->shapes) {
      if (shape.kind == ShapeKind::box) count(states[i].T_map_body, shape.size);
    }
  }
  for (const Door& door : doors) count(door.rigid.T_map_body, door.in_model.size);
  return all;
}

double dose_rate(const Hazard& source, double distance, double thickness) {
  const double from = std::max(kNearest, distance);
  return source.strength / (from * from) * std::exp2(-thickness / source.half_value);
}

void GasField::place(const Building& building, const Eigen::Vector3d& leak, double reach) {
  if (building_ == &building && reach_ == reach && (leak - leak_).norm() < cell_) return;
  building_ = &building;
  leak_ = leak;
  reach_ = reach;
  const double range = kReaches * reach;
  cell_ = std::max(kCell, 2 * range / kMaxCells);
  side_ = 2 * static_cast<int>(std::ceil(range / cell_)) + 1;
  const auto count = static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_);
  solid_.assign(count, 0);
  std::vector<const FixedObstacle*> walls;
  building.near(leak.head<2>(), range * std::numbers::sqrt2, leak.z(), leak.z() + 0.1, walls);
  const double corner = -(side_ / 2) * cell_;
  for (const FixedObstacle* wall : walls) {
    if (!holds_gas(*wall)) continue;
    const Eigen::Vector2d middle = wall->footprint.center - leak.head<2>();
    const auto span = [&](double at) {
      const auto index = [&](double x) {
        return std::clamp(static_cast<int>(std::lround((x - corner) / cell_)), 0, side_ - 1);
      };
      return std::pair(index(at - wall->footprint.bound - cell_), index(at + wall->footprint.bound + cell_));
    };
    const auto [first_row, last_row] = span(middle.y());
    const auto [first_column, last_column] = span(middle.x());
    for (int row = first_row; row <= last_row; ++row) {
      for (int column = first_column; column <= last_column; ++column) {
        const Eigen::Vector2d center(leak.x() + corner + column * cell_, leak.y() + corner + row * cell_);
        // A wall thinner than a cell must still separate its two sides.
        if (signed_distance(make_disc(center, cell_ / 2), wall->footprint) <= 0)
          solid_[static_cast<std::size_t>(row * side_ + column)] = 1;
      }
    }
  }
  spread();
}

/// Dijkstra's shortest paths from the middle.
void GasField::spread() {
  distance_.assign(solid_.size(), kInfinity);
  using Entry = std::pair<double, int>;  // distance, cell: ties ordered by cell
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  const int start = (side_ / 2) * side_ + side_ / 2;
  distance_[static_cast<std::size_t>(start)] = 0;
  open.emplace(0, start);
  while (!open.empty()) {
    const auto [distance, cell] = open.top();
    open.pop();
    if (distance > distance_[static_cast<std::size_t>(cell)]) continue;
    const int row = cell / side_, column = cell % side_;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int y = row + dy, x = column + dx;
        if (y < 0 || x < 0 || y >= side_ || x >= side_) continue;
        const auto next = static_cast<std::size_t>(y * side_ + x);
        // A thin diagonal wall may pass between two corners.
        const bool cuts_corner = solid_[static_cast<std::size_t>(row * side_ + x)] != 0 ||
                                 solid_[static_cast<std::size_t>(y * side_ + column)] != 0;
        const double longer = distance + cell_ * (dx != 0 && dy != 0 ? std::numbers::sqrt2 : 1);
        if (solid_[next] != 0 || cuts_corner || longer >= distance_[next]) continue;
        distance_[next] = longer;
        open.emplace(longer, static_cast<int>(next));
      }
    }
  }
}

bool GasField::blocked(const Building& building, const Footprint& line) const {
  std::vector<const FixedObstacle*> walls;
  building.near(line.center, line.bound, leak_.z(), leak_.z() + 0.1, walls);
  return std::any_of(walls.begin(), walls.end(), [&](const FixedObstacle* wall) {
    return holds_gas(*wall) && signed_distance(line, wall->footprint) <= 0;
  });
}

/// Through the neighbour cells with an air connection to p: its own cell may be solid beside a wall.
double GasField::distance_over_grid(const Building& building, const Eigen::Vector2d& p) const {
  const Eigen::Vector2d offset = p - leak_.head<2>();
  const Eigen::Vector2i cell = (offset / cell_).array().round().cast<int>() + side_ / 2;
  double nearest = kInfinity;
  for (int row = std::max(0, cell.y() - 1); row <= std::min(side_ - 1, cell.y() + 1); ++row) {
    for (int column = std::max(0, cell.x() - 1); column <= std::min(side_ - 1, cell.x() + 1); ++column) {
      const Eigen::Vector2d center(cell_ * (column - side_ / 2), cell_ * (row - side_ / 2));
      const double distance =
          distance_[static_cast<std::size_t>(row * side_ + column)] + (offset - center).norm();
      if (distance < nearest && !blocked(building, make_segment(p, leak_.head<2>() + center, 0)))
        nearest = distance;
    }
  }
  return nearest;
}

double GasField::concentration(const Building& building, double strength, const Eigen::Vector3d& p) const {
  const Eigen::Vector2d from = leak_.head<2>(), to = p.head<2>();
  double distance = (to - from).norm();
  if (distance > kReaches * reach_) return 0;
  if (blocked(building, make_segment(from, to, kBreath))) distance = distance_over_grid(building, to);
  return distance <= kReaches * reach_ ? strength * std::exp(-distance / reach_) : 0;
}

}  // namespace parhelion::simulation
