#include "route.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <queue>

namespace robot {
namespace {

constexpr int kCells = 140;     // a side of the grid, which has the robot in its middle
constexpr double kCell = 0.08;  // m
constexpr int kMiddle = kCells / 2;
constexpr double kSlow = 0.15;       // m/s
constexpr double kMinGap = 0.065;    // m: what the obstacle stop just allows
constexpr int kPatience = 20;        // stops in a row, for what moves to go away
constexpr double kPreferred = 0.35;  // m: nearer to an obstacle than this, a cell costs more

using Grid = std::vector<double>;

int cell_of(double offset) {
  return std::clamp(static_cast<int>(std::lround(offset / kCell)) + kMiddle, 0, kCells - 1);
}

Point2 point_of(int cell, const Pose2& pose) {
  return {pose.x + (cell % kCells - kMiddle) * kCell, pose.y + (cell / kCells - kMiddle) * kCell};
}

// m from each cell to the nearest seen point, at most `reach`.
Grid clearances(const Pose2& pose, const std::vector<Point2>& seen, double reach) {
  Grid clear(kCells * kCells, reach);
  const int around = static_cast<int>(reach / kCell) + 1;
  for (const Point2& p : seen) {
    if (std::max(std::abs(p.x - pose.x), std::abs(p.y - pose.y)) > kMiddle * kCell) continue;
    const int column = cell_of(p.x - pose.x), row = cell_of(p.y - pose.y);
    for (int y = std::max(0, row - around); y <= std::min(kCells - 1, row + around); ++y) {
      for (int x = std::max(0, column - around); x <= std::min(kCells - 1, column + around); ++x) {
        double& value = clear[static_cast<std::size_t>(y * kCells + x)];
        value = std::min(value, distance(p, point_of(y * kCells + x, pose)));
      }
    }
  }
  return clear;
}

// Dijkstra from `goal`: remaining distance from each cell, m; infinity: no path.
Grid costs_to(int goal, const Grid& clear, double clearance) {
  Grid cost(kCells * kCells, std::numeric_limits<double>::infinity());
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  cost[static_cast<std::size_t>(goal)] = 0;
  open.emplace(0, goal);
  while (!open.empty()) {
    const auto [value, cell] = open.top();
    open.pop();
    if (value > cost[static_cast<std::size_t>(cell)]) continue;
    for (const auto& [dx, dy] : std::array<std::pair<int, int>, 8>{
             {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}}}) {
      const int x = cell % kCells + dx, y = cell / kCells + dy;
      if (x < 0 || y < 0 || x >= kCells || y >= kCells) continue;
      const auto next = static_cast<std::size_t>(y * kCells + x);
      if (clear[next] < clearance) continue;
      const double tight = std::max(0.0, clearance + kPreferred - clear[next]) / kPreferred;
      const double there = value + kCell * std::hypot(dx, dy) * (1 + 3 * tight);
      if (there >= cost[next]) continue;
      cost[next] = there;
      open.emplace(there, static_cast<int>(next));
    }
  }
  return cost;
}

}  // namespace

Route::Route(const Settings& settings, std::vector<Point2> points)
    : settings_(settings), points_(std::move(points)) {
  for (const Point2& corner : settings_.footprint)
    radius_ = std::max(radius_, std::hypot(corner.x, corner.y));
}

std::vector<Point2> Route::path(const Pose2& pose, const std::vector<Point2>& seen, double clearance) const {
  const Point2& goal = points_[next_];
  Grid clear = clearances(pose, seen, clearance + kPreferred);
  // The start may be nearer to an obstacle than a path may be.
  for (std::size_t i = 0; i < clear.size(); ++i) {
    if (distance(point_of(static_cast<int>(i), pose), {pose.x, pose.y}) < 3 * kCell)
      clear[i] = std::max(clear[i], clearance);
  }
  const Grid cost = costs_to(cell_of(goal.y - pose.y) * kCells + cell_of(goal.x - pose.x), clear, clearance);
  int cell = kMiddle * kCells + kMiddle;
  std::vector<Point2> path{{pose.x, pose.y}};
  if (!std::isfinite(cost[static_cast<std::size_t>(cell)])) return {};
  while (cost[static_cast<std::size_t>(cell)] > 0) {
    int best = cell;
    for (const int step : {1, -1, kCells, -kCells, kCells + 1, kCells - 1, 1 - kCells, -1 - kCells}) {
      const int next = cell + step;
      if (next < 0 || next >= kCells * kCells || std::abs(next % kCells - cell % kCells) > 1) continue;
      if (cost[static_cast<std::size_t>(next)] < cost[static_cast<std::size_t>(best)]) best = next;
    }
    if (best == cell) break;
    cell = best;
    path.push_back(point_of(cell, pose));
  }
  return path;
}

// Pure pursuit (Coulter 1992), with a turn on the spot where the path leads elsewhere.
Twist2 Route::follow(const std::vector<Point2>& path, const Pose2& pose, double speed) const {
  constexpr double kAhead = 0.45;  // m
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (distance(path[i], {pose.x, pose.y}) < distance(path[nearest], {pose.x, pose.y})) nearest = i;
  }
  std::size_t at = nearest;
  while (at + 1 < path.size() && distance(path[at], {pose.x, pose.y}) < kAhead) ++at;
  const double dx = path[at].x - pose.x, dy = path[at].y - pose.y;
  const double off = wrap(std::atan2(dy, dx) - pose.yaw), length = std::max(0.1, std::hypot(dx, dy));
  if (std::abs(off) > 0.6) return {0, std::copysign(0.8 * settings_.yaw_rate, off)};
  const double curvature = 2 * std::sin(off) / length;
  const double left = distance(points_[next_], {pose.x, pose.y});
  double vx = std::min(speed, std::max(0.12, 0.8 * left));
  if (curvature != 0) vx = std::min(vx, settings_.yaw_rate / std::abs(curvature));
  return {vx, curvature * vx};
}

// m from the outline to the nearest seen point, if that is near.
double Route::gap(const Pose2& at, const std::vector<Point2>& seen) const {
  double nearest = 10;
  for (const Point2& p : seen) {
    if (distance(p, {at.x, at.y}) < radius_ + settings_.gap + 0.05)
      nearest = std::min(nearest, distance(settings_.footprint, inverse(at) * p));
  }
  return nearest;
}

// Backwards, or a turn on the spot: the motion that leads farthest away from what is too close, never nearer
// to it.
Twist2 Route::escape(const Pose2& pose, const std::vector<Point2>& seen) const {
  constexpr double kStep = 0.1, kHorizon = 0.8;  // s
  Twist2 best;
  double farthest = gap(pose, seen);
  for (const Twist2& twist : {Twist2{-0.15, 0}, Twist2{0, 0.5}, Twist2{0, -0.5}}) {
    double nearest = 10, last = 0;
    for (double t = kStep; t <= kHorizon; t += kStep) {
      last = gap(advance(pose, twist, t), seen);
      nearest = std::min(nearest, last);
    }
    if (nearest < gap(pose, seen) - 1e-3 || last <= farthest) continue;
    farthest = last;
    best = twist;
  }
  return best;
}

// Whether the robot keeps its gap to everything seen for the next seconds, or at least does not reduce it.
bool Route::is_safe(const std::vector<Point2>& path, Pose2 pose, Twist2 now, double speed,
                    const std::vector<Point2>& seen, double min_gap) const {
  constexpr double kStep = 0.1, kHorizon = 1.6;  // s
  const double wanted = std::min(min_gap, gap(pose, seen) - 0.005);
  for (double t = 0; t < kHorizon; t += kStep) {
    const Twist2 next = follow(path, pose, speed);
    now.vx += std::clamp(next.vx - now.vx, -kStep, kStep);
    now.wz = next.wz;
    pose = advance(pose, now, kStep);
    if (gap(pose, seen) < std::max(0.03, wanted * (1 - t / kHorizon / 2))) return false;
  }
  return true;
}

Twist2 Route::drive(const Pose2& pose, const Twist2& now, const std::vector<Point2>& seen) {
  while (next_ < points_.size() && distance(points_[next_], {pose.x, pose.y}) < settings_.reached) ++next_;
  reason_ = "";
  if (is_reached()) return {};
  std::vector<Point2> found;
  for (const double gap : {settings_.gap, settings_.gap / 2, 0.02}) {
    if (found.empty()) found = path(pose, seen, radius_ * 0.8 + gap);
  }
  reason_ = "no path to the next point";
  if (found.size() < 2) return {};
  reason_ = "";
  for (const double speed : {settings_.speed, 0.6 * settings_.speed, kSlow}) {
    if (!is_safe(found, pose, now, speed, seen, settings_.gap)) continue;
    blocked_ = 0;
    return follow(found, pose, speed);
  }
  // Moving obstacles have had time to go away: pass closer to the others, or go back.
  if (++blocked_ > kPatience && is_safe(found, pose, now, kSlow, seen, kMinGap))
    return follow(found, pose, kSlow);
  reason_ = "something is too close";
  return blocked_ > kPatience ? escape(pose, seen) : Twist2{};
}

}  // namespace robot
