#include "server/simulation/world/free_place.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "protocols/length_text.hpp"
#include "server/simulation/world/place_text.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kGap = 0.02;         // m of clearance for an agent that appears
constexpr double kSearchRange = 6.0;  // m
constexpr double kSpacing = 0.1;      // m, of the candidates
/// m, radius of a disc that is moved over the floor in steps of kSpacing: it skips no obstacle, however thin.
constexpr double kPassRadius = 0.06;
constexpr int kReach = static_cast<int>(kSearchRange / kSpacing) + 1;  // steps
constexpr int kSide = 2 * kReach + 1;
constexpr double kAround = 50;  // m around the modelled site where agents are allowed, such as yards

}  // namespace

/// An error text if the position is too far from everything modelled; else empty.
std::string off_site(const Building& building, const Eigen::Vector2d& p) {
  const Eigen::AlignedBox2d& site = building.site();
  if (site.isEmpty() || site.exteriorDistance(p) <= kAround) return {};
  return place_text(p) + " is far outside the site, which reaches from " + place_text(site.min()) + " to " +
         place_text(site.max()) + "; expected a place at most " + length_text(kAround) + " from it";
}

std::string PlaceSearch::obstruction(const Pose2& pose) {
  Footprint placed;
  place(form_.footprint, pose, placed);
  const auto hits = [&placed](const Footprint& other, double gap) {
    return distance_bound(placed, other) < gap && signed_distance(placed, other) < gap;
  };
  if (std::any_of(zone_.begin(), zone_.end(), [&](const Footprint& f) { return hits(f, 0); })) {
    return "on a trainee's robot or inside its stopping distance";
  }
  const Building& building = *environment_.building;
  const double floor = building.floor_height(pose.position());
  near_.clear();
  building.near(placed.center, placed.bound + kGap, floor + 0.02, floor + form_.size.z(), near_);
  for (const FixedObstacle* obstacle : near_) {
    if (hits(obstacle->footprint, kGap)) return "in '" + obstacle->name + "' of the building";
  }
  for (const Agent& agent : agents_) {
    if (&agent == except_ || !hits(agent.placed, kGap)) continue;
    return std::string(agent.of_site ? "on the site's '" : "on agent '") + agent.definition.name + "'";
  }
  for (const Footprint& disc : environment_.unmodelled) {
    if (hits(disc, kGap)) return "on something real that the model does not explain";
  }
  for (const PlacedPerson& person : environment_.people.placed()) {
    if (hits(person.disc, kGap)) return "on a real person";
  }
  return {};
}

const std::vector<const FixedObstacle*>& PlaceSearch::touched_at(const Eigen::Vector2d& p, double floor) {
  const Footprint disc = make_disc(p, kPassRadius);
  near_.clear();
  environment_.building->near(p, kPassRadius, floor + 0.02, floor + form_.size.z(), near_);
  std::erase_if(near_,
                [&](const FixedObstacle* each) { return signed_distance(each->footprint, disc) >= 0; });
  return near_;
}

/// Only the obstacles in which `from` lies may be passed, and only to get out of them.
bool PlaceSearch::in_straight_line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double floor) {
  const std::vector<const FixedObstacle*> around = touched_at(from, floor);
  bool inside = !around.empty();
  const int steps = std::max(1, static_cast<int>(std::ceil((to - from).norm() / kSpacing)));
  for (int i = 1; i <= steps; ++i) {
    const auto& touched = touched_at(from + (to - from) * i / steps, floor);
    inside = inside && !touched.empty();
    const auto is_around = [&](const FixedObstacle* each) {
      return std::find(around.begin(), around.end(), each) != around.end();
    };
    if (!touched.empty() && !(inside && std::all_of(touched.begin(), touched.end(), is_around))) return false;
  }
  return true;
}

/// Marks the free positions on a lattice around `from` that are connected with it.
void PlaceSearch::flood(const Eigen::Vector2d& from, double floor) {
  connected_.assign(std::size_t{kSide} * kSide, 0);
  if (!touched_at(from, floor).empty()) return;
  std::vector<std::pair<int, int>> open{{kReach, kReach}};
  connected_[std::size_t{kReach} * kSide + kReach] = 1;
  while (!open.empty()) {
    const auto [x, y] = open.back();
    open.pop_back();
    for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      const int to_x = x + dx, to_y = y + dy;
      if (to_x < 0 || to_y < 0 || to_x >= kSide || to_y >= kSide) continue;
      char& connected = connected_[static_cast<std::size_t>(to_y * kSide + to_x)];
      const Eigen::Vector2d p = from + kSpacing * Eigen::Vector2d(to_x - kReach, to_y - kReach);
      if (connected != 0 || !touched_at(p, floor).empty()) continue;
      connected = 1;
      open.emplace_back(to_x, to_y);
    }
  }
}

bool PlaceSearch::reachable(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const double floor = environment_.building->floor_height(from);
  if (in_straight_line(from, to, floor)) return true;
  if (connected_.empty()) flood(from, floor);
  const Eigen::Vector2d steps = (to - from) / kSpacing;
  const int x = kReach + static_cast<int>(std::lround(steps.x()));
  const int y = kReach + static_cast<int>(std::lround(steps.y()));
  return connected_[static_cast<std::size_t>(y * kSide + x)] != 0;
}

/// Searches rings around the position, nearest first.
std::optional<Pose2> PlaceSearch::nearest_free(const Pose2& pose) {
  connected_.clear();
  for (double radius = 0; radius <= kSearchRange; radius += kSpacing) {
    const int count = std::max(1, static_cast<int>(2 * std::numbers::pi * radius / kSpacing / 2));
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * std::numbers::pi * i / count;
      const Pose2 candidate{pose.x + radius * std::cos(angle), pose.y + radius * std::sin(angle), pose.yaw};
      if (obstruction(candidate).empty() && reachable(pose.position(), candidate.position()))
        return candidate;
    }
  }
  return std::nullopt;
}

Status check_place(const AgentDefinition& agent, const AgentForm& form, const Agent* except,
                   const Environment& environment, const Agents& agents, const RealRobots& real_robots,
                   std::span<const std::optional<RealRobotState>> now) {
  const std::string who = "agent '" + agent.name + "': ";
  const Pose2 pose = planar_pose(agent.T_map_base);
  if (!agent.T_map_base.finite() || std::abs(pose.x) > kMaxCoordinate || std::abs(pose.y) > kMaxCoordinate) {
    return Error{who + "its place is not finite or farther than 100 km; expected metres in the map"};
  }
  if (const std::string wrong = off_site(*environment.building, pose.position()); !wrong.empty())
    return Error{who + wrong};
  std::vector<Footprint> zone;
  for (std::size_t i = 0; i < real_robots.size(); ++i) {
    const RealRobot& robot = real_robots[i];
    if (is_known(now[i])) append_stop_zone(robot, *now[i], zone);
    // A robot with unknown pose is still near its last one.
    if (!now[i] && robot.ever_present) append_stop_zone(robot, robot.last, zone);
  }
  PlaceSearch search(form, except, std::move(zone), environment, agents);
  const std::string what = search.obstruction(pose);
  if (what.empty()) return {};
  const auto free = search.nearest_free(pose);
  return Error{who + place_text(pose.position()) + " is " + what + "; " +
               (free ? "the nearest free place is " + place_text(free->position())
                     : "no free place within " + length_text(kSearchRange) + " on this side of the walls")};
}

}  // namespace parhelion::simulation
