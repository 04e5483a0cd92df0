#include "server/tick/check_reach.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <set>

#include "server/simulation/building/building.hpp"
#include "server/simulation/building/route_grid.hpp"

namespace parhelion::tick {
namespace {

constexpr double kHeight = 0.5;               // m over the floor: range of obstacles for any robot
constexpr double kSameFloor = 0.3;            // m
constexpr double kBeyond = 2.0;               // m around the building that routes may use
constexpr double kMaxSide = 60.0;             // m of a zone: only this much is searched
constexpr std::size_t kMaxCells = 2'000'000;  // 2 hectares: a search that gets this far counts as success

void collect(const Condition& condition, std::set<std::string>& zones) {
  if (condition.kind == Condition::Kind::reach) zones.insert(condition.target);
  for (const Condition& part : condition.parts) collect(part, zones);
}

/// m, radius of the largest disc around base_link inside the footprint: free at any heading.
double inner_radius(const RobotDescription& robot) {
  double radius = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < robot.footprint.size(); ++i) {
    const Eigen::Vector2d& a = robot.footprint[i];
    const Eigen::Vector2d along = robot.footprint[(i + 1) % robot.footprint.size()] - a;
    if (along.norm() > 0)
      radius = std::min(radius, std::abs(along.x() * a.y() - along.y() * a.x()) / along.norm());
  }
  return std::isfinite(radius) ? radius : 0;
}

/// One floor of a building, and its free space.
class Floor {
 public:
  Floor(std::shared_ptr<const simulation::Building> building, double height, double radius)
      : building_(std::move(building)), height_(height), radius_(radius), grid_(building_, height, kHeight) {}

  bool has_room(const Eigen::Vector2d& p) { return grid_.clearance(p) >= radius_; }
  /// Centres of free cells inside the zone.
  std::vector<simulation::RouteCell> room_in(const Zone& zone) {
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& corner : zone.outline) box.extend(corner);
    box = box.intersection(Eigen::AlignedBox2d(box.center() - Eigen::Vector2d::Constant(kMaxSide / 2),
                                               box.center() + Eigen::Vector2d::Constant(kMaxSide / 2)));
    const simulation::RouteCell low = simulation::RouteGrid::cell_of(box.min()),
                                high = simulation::RouteGrid::cell_of(box.max());
    const double z = std::clamp(height_, zone.bottom, zone.top);
    std::vector<simulation::RouteCell> room;
    const auto look = [&](const simulation::RouteCell& cell, const Eigen::Vector2d& p) {
      if (inside(zone, {p.x(), p.y(), z}, 0) && has_room(p)) room.push_back(cell);
    };
    for (std::int32_t y = low.y; y <= high.y; ++y) {
      for (std::int32_t x = low.x; x <= high.x; ++x) look({x, y}, simulation::RouteGrid::center({x, y}));
    }
    // For a zone smaller than a cell.
    if (room.empty()) look(simulation::RouteGrid::cell_of(box.center()), box.center());
    return room;
  }
  /// Whether a route leads from `start` to one of the cells; yes, if the search would be too large.
  bool leads(const Eigen::Vector2d& start, const std::vector<simulation::RouteCell>& goals) {
    const auto less = [](const simulation::RouteCell& a, const simulation::RouteCell& b) {
      return std::tie(a.x, a.y) < std::tie(b.x, b.y);
    };
    const std::set<simulation::RouteCell, decltype(less)> wanted(goals.begin(), goals.end(), less);
    std::set<simulation::RouteCell, decltype(less)> seen(less);
    Eigen::AlignedBox2d bounds = building_->extent();
    bounds.extend(start);
    for (const simulation::RouteCell& goal : goals) bounds.extend(simulation::RouteGrid::center(goal));
    bounds.min().array() -= kBeyond;
    bounds.max().array() += kBeyond;
    std::deque<simulation::RouteCell> open{simulation::RouteGrid::cell_of(start)};
    seen.insert(open.front());
    for (; !open.empty(); open.pop_front()) {
      const simulation::RouteCell at = open.front();
      if (wanted.contains(at) || seen.size() > kMaxCells) return true;
      for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        const simulation::RouteCell next{at.x + dx, at.y + dy};
        const Eigen::Vector2d p = simulation::RouteGrid::center(next);
        if (bounds.contains(p) && !seen.contains(next) && has_room(p)) {
          seen.insert(next);
          open.push_back(next);
        }
      }
    }
    return false;
  }
  /// Name of the obstacle that contains p most deeply; empty: none.
  std::string obstacle_at(const Eigen::Vector2d& p) const {
    std::vector<const simulation::FixedObstacle*> near;
    building_->near(p, 5, height_ + simulation::RouteGrid::kOverFloor, height_ + kHeight, near);
    const simulation::Footprint point = simulation::make_disc(p, 0);
    const auto nearest = std::min_element(near.begin(), near.end(), [&](const auto* a, const auto* b) {
      return simulation::signed_distance(a->footprint, point) <
             simulation::signed_distance(b->footprint, point);
    });
    return nearest == near.end() ? "" : (*nearest)->name;
  }

 private:
  std::shared_ptr<const simulation::Building> building_;
  double height_, radius_;
  simulation::RouteGrid grid_;
};

Eigen::Vector2d middle_of(const Zone& zone) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& corner : zone.outline) sum += corner;
  return sum / static_cast<double>(zone.outline.size());
}

/// Heights of surfaces in the zone: floors, or raised ones such as a platform.
std::vector<double> heights_in(const simulation::Building& building, const Zone& zone,
                               const Eigen::Vector2d& middle) {
  std::vector<double> heights{std::clamp(building.floor_height(middle), zone.bottom, zone.top)};
  double range = 0;
  for (const Eigen::Vector2d& corner : zone.outline) range = std::max(range, (corner - middle).norm());
  std::vector<const simulation::FixedObstacle*> near;
  building.near(middle, range, zone.bottom, zone.top, near);
  for (const simulation::FixedObstacle* each : near) {
    const bool climbed =
        each->label == EntityLabel::stairs || is_ground(each->label) || each->label == EntityLabel::unknown;
    if (climbed && each->top >= zone.bottom && each->top <= zone.top) heights.push_back(each->top);
  }
  return heights;
}

Status check_zone(const Configuration& configuration,
                  const std::shared_ptr<const simulation::Building>& building, const Zone& zone) {
  const Eigen::Vector2d middle = middle_of(zone);
  const double radius = inner_radius(configuration.robot);
  bool room = false, leads = !simulates_trainee(configuration.scenario);
  for (const double height : heights_in(*building, zone, middle)) {
    Floor floor(building, height, radius);
    const std::vector<simulation::RouteCell> cells = floor.room_in(zone);
    room = room || !cells.empty();
    if (cells.empty() || leads) continue;
    const Eigen::Vector2d start = configuration.scenario.trainee->T_map_base.translation().head<2>();
    // Other floors are reached by stairs, which are not checked.
    leads = std::abs(building->floor_height(start) - height) > kSameFloor || floor.leads(start, cells);
  }
  const std::string what = "zone '" + zone.name + "' cannot be reached: ";
  if (!room) {
    const Floor floor(building, std::clamp(building->floor_height(middle), zone.bottom, zone.top), radius);
    const std::string in = floor.obstacle_at(middle);
    return Error{what + "the robot does not fit into it" + (in.empty() ? "" : "; it lies in '" + in + "'") +
                 "; move it, or make it larger"};
  }
  if (leads) return {};
  return Error{what + "no route leads to it from the robot's start, even with all doors open"};
}

}  // namespace

Status check_reach(const Configuration& configuration) {
  const Scenario& scenario = configuration.scenario;
  if (!scenario.training || scenario.mapping || configuration.model.entities.empty()) return {};
  std::shared_ptr<const simulation::Building> building;
  for (const Task& task : scenario.training->tasks) {
    std::set<std::string> wanted;
    collect(task.done, wanted);
    for (const Zone& zone : scenario.zones) {
      if (!wanted.contains(zone.name)) continue;
      if (!building) {
        auto made = simulation::Building::create(configuration.model);
        if (!made) return made.error();
        building = std::move(*made);
      }
      if (const Status reached = check_zone(configuration, building, zone); !reached)
        return Error{"task '" + task.name + "': " + reached.error().message};
    }
  }
  return {};
}

}  // namespace parhelion::tick
