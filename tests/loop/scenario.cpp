// The scenario of a drive: what is virtual in it, and what the trainee is to do.
#include <cmath>
#include <stdexcept>

#include "tests/loop/closed_loop.hpp"

namespace parhelion::test {
namespace {

constexpr double kFromStart = 1.1, kApart = 0.7, kFromThings = 0.48;  // m

class Casting {
 public:
  Casting(const Site& site, Scenario& scenario)
      : site_(site), scenario_(scenario), draw_(site.seed * 31 + 7) {}

  Draw& draw() { return draw_; }
  /// Whether something may be placed there.
  bool is_free(const Eigen::Vector2d& p, double from_things) const {
    if (clearance(site_, p) < from_things) return false;
    for (const Pose2& start : {site_.start, site_.other_start}) {
      if ((p - start.position()).norm() < kFromStart) return false;
    }
    for (const AgentDefinition& agent : scenario_.agents) {
      if ((p - agent.T_map_base.translation().head<2>()).norm() < kApart) return false;
    }
    return true;
  }
  /// The first of the places that `propose` makes which is free.
  template <class Propose>
  Eigen::Vector2d place(const Propose& propose) {
    constexpr int kTries = 2000;
    for (int tries = 0; tries < kTries; ++tries) {
      const Eigen::Vector2d p = propose();
      if (is_free(p, tries < kTries / 2 ? kFromThings : 0.7 * kFromThings)) return p;
    }
    throw std::runtime_error("site " + std::to_string(site_.seed) + " has no room for its agents");
  }
  Eigen::Vector2d anywhere(double from, double to) {
    return place(
        [&] { return Eigen::Vector2d(draw_.within(from, to), draw_.within(0.7, site_.width - 0.7)); });
  }
  /// Beside the path from a to b, where a robot that drives straight on would touch it.
  Eigen::Vector2d beside(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return place([&] {
      const Eigen::Vector2d along = (b - a).normalized(), across(-along.y(), along.x());
      const double off = draw_.within(0.1, 0.5) * (draw_.chance(0.5) ? 1 : -1);
      return Eigen::Vector2d(a + draw_.within(0.3, 0.8) * (b - a) + off * across);
    });
  }
  AgentDefinition& add(const std::string& name, AgentKind kind, const Eigen::Vector2d& at) {
    AgentDefinition agent;
    agent.name = name, agent.kind = kind;
    agent.T_map_base = Transform<Map, Base>::planar(at.x(), at.y(), draw_.within(-3, 3));
    scenario_.agents.push_back(agent);
    return scenario_.agents.back();
  }
  /// Back and forth between the place where it is and another one of the same room.
  void patrol(AgentDefinition& agent, double from, double to, double speed) {
    agent.behaviour.kind = BehaviourKind::patrol;
    agent.behaviour.speed = speed;
    const Eigen::Vector2d here = agent.T_map_base.translation().head<2>();
    const Eigen::Vector2d there = place([&] {
      return Eigen::Vector2d(draw_.within(from, to), here.y() > site_.width / 2
                                                         ? draw_.within(0.6, 1.6)
                                                         : site_.width - draw_.within(0.6, 1.6));
    });
    agent.behaviour.waypoints = {there, here};
  }

 private:
  const Site& site_;
  Scenario& scenario_;
  Draw draw_;
};

Training training(Arrangement arrangement) {
  Training training;
  if (arrangement == Arrangement::robot_drives_itself) training.robot = "robot_1";
  training.text = "Drive to the goal, and touch nobody.";
  Task task;
  task.name = "goal", task.points = 10, task.required = true;
  task.done.kind = Condition::Kind::reach;
  task.done.target = "goal";
  training.tasks = {task};
  Penalty contact;
  contact.name = "contact", contact.points = 5;
  contact.when.event = EventKind::contact_started;
  Penalty near_miss = contact;
  near_miss.name = "near miss", near_miss.points = 0.5;
  near_miss.when.event = EventKind::near_miss;
  training.penalties = {contact, near_miss};
  return training;
}

Task event_task(const std::string& name, double points, EventKind event, const std::string& object) {
  Task task;
  task.name = name, task.points = points;
  task.done.kind = Condition::Kind::event;
  task.done.event = event, task.done.object = object;
  return task;
}

/// A thing and a container in front of the robot, and nothing else.
void add_lift(const Site& site, Scenario& scenario) {
  const LiftPlaces places = lift_places(site);
  AgentDefinition part, container;
  part.name = "part_1", part.kind = AgentKind::box, part.size = {0.06, 0.06, places.height}, part.mass = 0.8;
  const Eigen::Vector2d direction = places.thing - site.start.position();
  part.T_map_base = Transform<Map, Base>::planar(places.thing.x(), places.thing.y(),
                                                 std::atan2(direction.y(), direction.x()));
  container.name = "container_1", container.kind = AgentKind::container, container.size = {0.44, 0.44, 0.3};
  container.T_map_base =
      Transform<Map, Base>::planar(places.container.x(), places.container.y(), site.start.yaw);
  scenario.agents = {part, container};
  Training lesson;
  lesson.text = "Lift the part and put it into the container.";
  lesson.tasks = {event_task("grip", 20, EventKind::gripped, "part_1"),
                  event_task("lift", 20, EventKind::lifted, "part_1"),
                  event_task("into the container", 60, EventKind::placed, "container_1")};
  scenario.zones.clear();
  scenario.training = lesson;
}

Zone goal_zone(const Eigen::Vector2d& goal) {
  constexpr double h = 0.5;  // m
  Zone zone;
  zone.name = "goal";
  for (const Eigen::Vector2d& corner :
       {Eigen::Vector2d(-h, -h), Eigen::Vector2d(h, -h), Eigen::Vector2d(h, h), Eigen::Vector2d(-h, h)})
    zone.outline.push_back(goal + corner);
  return zone;
}

}  // namespace

const char* to_string(Arrangement arrangement) {
  switch (arrangement) {
    case Arrangement::trainee_drives:
      return "trainee drives";
    case Arrangement::careless_trainee_drives:
      return "careless trainee drives";
    case Arrangement::robot_drives_itself:
      return "robot drives itself";
    case Arrangement::trainee_lifts:
      return "trainee lifts";
  }
  return "";
}

LiftPlaces lift_places(const Site& site) {
  constexpr double kThingAt = 0.58, kTubAt = 0.57, kRoom = 0.3;  // m
  const auto at = [&](double range, double angle) {
    return Eigen::Vector2d(site.start.position() + range * Eigen::Vector2d(std::cos(site.start.yaw + angle),
                                                                           std::sin(site.start.yaw + angle)));
  };
  for (const double thing : {0.0, 0.3, -0.3, 0.6, -0.6}) {
    for (const double apart : {1.4, -1.4, 1.7, -1.7}) {
      const LiftPlaces places{at(kThingAt, thing), at(kTubAt, thing + apart), 0.45};
      if (clearance(site, places.thing) > kRoom / 2 && clearance(site, places.container) > kRoom)
        return places;
    }
  }
  throw std::runtime_error("site " + std::to_string(site.seed) + " has no room for a container");
}

Scenario loop_scenario(const Site& site, Arrangement arrangement) {
  const bool itself = arrangement == Arrangement::robot_drives_itself;
  Scenario scenario;
  scenario.name = "closed loop " + std::to_string(site.seed);
  scenario.seed = site.seed + 1;
  scenario.model = "model.yaml", scenario.map = "site.yaml";
  scenario.zones = {goal_zone(itself ? site.other_route.back() : site.route.back())};
  scenario.training = training(arrangement);
  if (arrangement == Arrangement::trainee_lifts) {
    add_lift(site, scenario);
    return scenario;
  }
  Casting cast(site, scenario);
  if (itself) {
    AgentDefinition& robot = cast.add("robot_1", AgentKind::robot, site.other_start.position());
    robot.T_map_base =
        Transform<Map, Base>::planar(site.other_start.x, site.other_start.y, site.other_start.yaw);
    robot.behaviour.kind = BehaviourKind::teleop;
    robot.laser = "utm-30lx";
  }
  const double first = site.partition - 0.6, second = site.partition + 1.6, end = site.length - 0.7;
  cast.add("barrel_1", AgentKind::barrel, cast.beside(site.start.position(), site.route.front()));
  AgentDefinition& patrolling = cast.add("person_1", AgentKind::person, cast.anywhere(1.4, first));
  cast.patrol(patrolling, 1.2, first, cast.draw().within(0.3, 0.8));
  AgentDefinition& person = cast.add("person_2", AgentKind::person, cast.anywhere(second, end));
  person.behaviour.kind = BehaviourKind::wander;
  person.behaviour.speed = cast.draw().within(0.3, 0.7);
  if (!itself) {
    AgentDefinition& robot = cast.add("robot_1", AgentKind::robot, cast.anywhere(second, end));
    robot.behaviour.kind = BehaviourKind::wander;
    robot.behaviour.speed = cast.draw().within(0.2, 0.5);
  }
  return scenario;
}

}  // namespace parhelion::test
