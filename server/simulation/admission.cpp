// Whether an agent may be: its name, what it is to do, and its place.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "protocols/nearest_name.hpp"
#include "server/simulation/state.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kGap = 0.02;         // m kept free between an agent that appears and what is there
constexpr double kSearchRange = 6.0;  // m
constexpr double kMostSpeed = 3.0;    // m/s that a behaviour may ask for
constexpr double kMostDistance = 50;  // m that a behaviour may keep
constexpr double kMostPlace = 1e5;    // m from the map's origin
constexpr double kAround =
    50;  // m around the modelled site that an agent may be in: yards, what is not modelled

bool fits_a_channel(const std::string& name) {
  return !name.empty() && name.size() <= 40 && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
}

std::string metres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

std::string place_text(const Pose2& pose) { return "(" + metres(pose.x) + ", " + metres(pose.y) + ")"; }

/// What is wrong with a place that is too far from all that is modelled; empty where it is not.
std::string off_site(const Building& building, const Eigen::Vector2d& p) {
  const Eigen::AlignedBox2d& site = building.site();
  if (site.isEmpty() || site.exteriorDistance(p) <= kAround) return {};
  const auto text = [](const Eigen::Vector2d& at) { return place_text({at.x(), at.y(), 0}); };
  return text(p) + " is far outside the site, which reaches from " + text(site.min()) + " to " +
         text(site.max()) + "; expected a place at most " + metres(kAround) + " m from it";
}

}  // namespace

bool finite(const Twist2& twist) {
  return std::isfinite(twist.vx) && std::isfinite(twist.vy) && std::isfinite(twist.wz);
}

Status Simulation::State::check_behaviour(const AgentDefinition& agent) const {
  const Behaviour& behaviour = agent.behaviour;
  const std::string who = "agent '" + agent.name + "': ";
  const bool moves = agent.kind == AgentKind::person || agent.kind == AgentKind::robot;
  if (!moves && behaviour.kind != BehaviourKind::stay) {
    return Error{who + "a " + to_string(agent.kind) + " cannot " + to_string(behaviour.kind) +
                 "; only persons and robots move by themselves"};
  }
  if (!std::isfinite(behaviour.speed) || behaviour.speed < 0 || behaviour.speed > kMostSpeed) {
    return Error{who + "speed " + std::to_string(behaviour.speed) + " m/s; expected 0 to " +
                 metres(kMostSpeed)};
  }
  const bool on_its_way = behaviour.kind == BehaviourKind::patrol || behaviour.kind == BehaviourKind::go;
  if (on_its_way && behaviour.waypoints.empty()) {
    return Error{who + "to " + to_string(behaviour.kind) + " it needs at least one waypoint"};
  }
  if (!std::isfinite(behaviour.distance) || behaviour.distance < 0 || behaviour.distance > kMostDistance) {
    return Error{who + "distance " + std::to_string(behaviour.distance) + " m; expected 0 to " +
                 metres(kMostDistance)};
  }
  for (const Eigen::Vector2d& waypoint : behaviour.waypoints) {
    if (!waypoint.allFinite() || waypoint.lpNorm<Eigen::Infinity>() > kMostPlace)
      return Error{who + "a waypoint is not finite or farther than 100 km; expected x, y in metres"};
    if (const std::string wrong = off_site(*building, waypoint); !wrong.empty())
      return Error{who + "its waypoint " + wrong};
  }
  if (behaviour.kind == BehaviourKind::go) return check_goals(agent);
  const bool has_target = behaviour.kind == BehaviourKind::follow || behaviour.kind == BehaviourKind::flee ||
                          behaviour.kind == BehaviourKind::block;
  if (has_target && behaviour.target == agent.name)
    return Error{who + "it cannot " + to_string(behaviour.kind) + " itself; name another target"};
  return {};
}

/// Goals where nobody can stand; whether a way leads to the others is found out as it goes.
Status Simulation::State::check_goals(const AgentDefinition& agent) const {
  const AgentForm form = form_of(agent);
  for (const Eigen::Vector2d& goal : agent.behaviour.waypoints) {
    const double floor = building->floor_height(goal);
    std::vector<const FixedObstacle*> beside;
    building->near(goal, form.footprint.bound, floor + 0.02, floor + form.size.z(), beside);
    const Footprint there = make_disc(goal, form.footprint.bound);
    for (const FixedObstacle* obstacle : beside) {
      if (obstacle->label == EntityLabel::door || signed_distance(there, obstacle->footprint) >= 0) continue;
      return Error{"agent '" + agent.name + "': it cannot go to " + place_text({goal.x(), goal.y(), 0}) +
                   ": it has no room there beside '" + obstacle->name + "' of the building"};
    }
  }
  return {};
}

std::shared_ptr<const RobotModel> Simulation::State::find_model(const std::string& name) const {
  const auto at = std::find_if(options.robot_models.begin(), options.robot_models.end(),
                               [&](const auto& model) { return model->name == name; });
  return at == options.robot_models.end() ? nullptr : *at;
}

Status Simulation::State::check_model(const AgentDefinition& agent) const {
  if (agent.model.empty()) return {};
  const std::string who = "agent '" + agent.name + "': ";
  if (agent.kind != AgentKind::robot) return Error{who + "only a robot has a robot model"};
  if (find_model(agent.model)) return {};
  std::vector<std::string> known;
  for (const auto& model : options.robot_models) known.push_back(model->name);
  return Error{who + "no robot model '" + agent.model + "'" + suggestion_or_known(agent.model, known)};
}

AgentForm Simulation::State::form_of(const AgentDefinition& agent) const {
  const auto model = agent.model.empty() ? nullptr : find_model(agent.model);
  return model ? robot_form(*model) : agent_form(agent);
}

Status Simulation::State::check_definition(const AgentDefinition& agent, bool trainee) const {
  if (!fits_a_channel(agent.name)) {
    return Error{"agent name '" + agent.name + "': expected 1 to 40 letters, digits, '_' and '-'"};
  }
  const bool taken = std::any_of(agents.begin(), agents.end(),
                                 [&](const auto& a) { return a->definition.name == agent.name; });
  if (taken) return Error{"there is an agent '" + agent.name + "' already; choose another name, or move it"};
  if (agent.name == real.name && !trainee)
    return Error{"agent '" + agent.name + "' has the real robot's name; choose another"};
  const auto& fixed = building->obstacles();
  if (std::any_of(fixed.begin(), fixed.end(), [&](const FixedObstacle& o) { return o.name == agent.name; })) {
    return Error{"agent '" + agent.name + "' has the name of a part of the building; choose another"};
  }
  if (agents.size() >= options.most_agents) {
    return Error{
        "there are " + std::to_string(agents.size()) +
        " agents, and the scenario's most_agents allows no more: what is stepped and sent in time on "
        "one machine; remove some first, or raise it"};
  }
  if (Status status = check_size(agent); !status) return status;
  if (Status status = check_model(agent); !status) return status;
  return check_behaviour(agent);
}

std::string Simulation::State::occupied(const AgentForm& form, const Pose2& pose, const Agent* except,
                                        const std::vector<Footprint>& zone) {
  Footprint placed;
  place(form.footprint, pose, placed);
  const auto hits = [&placed](const Footprint& other, double gap) {
    return distance_bound(placed, other) < gap && signed_distance(placed, other) < gap;
  };
  if (std::any_of(zone.begin(), zone.end(), [&](const Footprint& f) { return hits(f, 0); })) {
    return "on the real robot or inside its stopping distance";
  }
  const double floor = building->floor_height(pose.position());
  near.clear();
  building->near(placed.center, placed.bound + kGap, floor + 0.02, floor + form.size.z(), near);
  for (const FixedObstacle* obstacle : near) {
    if (hits(obstacle->footprint, kGap)) return "in '" + obstacle->name + "' of the building";
  }
  for (const auto& agent : agents) {
    if (agent.get() != except && hits(agent->placed, kGap))
      return "on agent '" + agent->definition.name + "'";
  }
  for (const Footprint& disc : real_discs) {
    if (hits(disc, kGap)) return "on something real that the model does not explain";
  }
  return {};
}

/// Rings around the place, the nearest first.
std::optional<Pose2> Simulation::State::nearest_free(const AgentForm& form, const Pose2& pose,
                                                     const Agent* except,
                                                     const std::vector<Footprint>& zone) {
  constexpr double spacing = 0.1;  // m
  for (double radius = 0; radius <= kSearchRange; radius += spacing) {
    const int count = std::max(1, static_cast<int>(2 * std::numbers::pi * radius / spacing / 2));
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * std::numbers::pi * i / count;
      const Pose2 candidate{pose.x + radius * std::cos(angle), pose.y + radius * std::sin(angle), pose.yaw};
      if (occupied(form, candidate, except, zone).empty()) return candidate;
    }
  }
  return std::nullopt;
}

Status Simulation::State::check_place(const AgentDefinition& agent, const Agent* except,
                                      const std::optional<RealRobotState>& now) {
  const std::string who = "agent '" + agent.name + "': ";
  const Pose2 pose = planar_pose(agent.T_map_base);
  if (!agent.T_map_base.finite() || std::abs(pose.x) > kMostPlace || std::abs(pose.y) > kMostPlace) {
    return Error{who + "its place is not finite or farther than 100 km; expected metres in the map"};
  }
  if (const std::string wrong = off_site(*building, pose.position()); !wrong.empty())
    return Error{who + wrong};
  std::vector<Footprint> zone;
  if (now && now->T_map_base.finite() && finite(now->twist)) stop_zone(*now, zone);
  // Where the robot is not known now, it is still somewhere near its last place.
  if (!now && real.ever_present) stop_zone(real.last, zone);
  const AgentForm form = form_of(agent);
  const std::string what = occupied(form, pose, except, zone);
  if (what.empty()) return {};
  const auto free = nearest_free(form, pose, except, zone);
  return Error{who + place_text(pose) + " is " + what + "; " +
               (free ? "the nearest free place is " + place_text(*free)
                     : "no free place within " + metres(kSearchRange) + " m")};
}

}  // namespace parhelion::simulation
