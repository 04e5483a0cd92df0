// A step (part of Simulation): sets the real robots' states, drives the agents, runs the physics, and then
// produces events and a record.
#include <algorithm>
#include <cassert>
#include <utility>

#include "server/simulation/agent_lasers.hpp"
#include "server/simulation/events/door_events.hpp"
#include "server/simulation/events/supervision.hpp"
#include "server/simulation/parts.hpp"
#include "server/simulation/world/free_place.hpp"

namespace parhelion::simulation {

void Simulation::Parts::clear_stop_zone(const RealRobot& robot, const RealRobotState& state, bool all) {
  const auto returns = [&](const Agent& agent) {
    return all || agent.seen_by[robot.index].shown == AgentShown::returning;
  };
  if (std::none_of(agents.begin(), agents.end(), returns)) return;
  std::vector<Footprint> zone;
  append_stop_zone(robot, state, zone);
  for (Agent& agent : agents) {
    if (!returns(agent)) continue;
    if (robot.grip.is_around(agent.definition.name)) continue;
    bool& is_clear = agent.seen_by[robot.index].clear_of_real;
    is_clear = true;
    const bool inside = std::any_of(zone.begin(), zone.end(), [&](const Footprint& footprint) {
      return distance_bound(footprint, agent.placed) <= 0 && signed_distance(footprint, agent.placed) <= 0;
    });
    if (!inside) continue;
    const auto free = PlaceSearch(agent.form, &agent, zone, environment, agents).nearest_free(agent.pose);
    if (!free) {
      is_clear = false;
      continue;
    }
    put(agent, *free);
    publish(agent_event(EventKind::agent_moved, agent, clock.now(), 0,
                        "moved: it would have reappeared within the robot's stopping distance"));
  }
}

void Simulation::Parts::move_real_robot(RealRobot& robot, const std::optional<RealRobotState>& state) {
  if (!is_known(state)) {
    if (robot.present) {
      contacts.forget(robot.name, clock.now(), events);
      robot.watch.close(clock.now(), options.zones, events);
    }
    suspend_real_robot(robot, physics);
    return;
  }
  const bool jumped = !robot.present || state->relocalized;
  if (jumped) {
    ++robot.epoch;
    contacts.forget(robot.name, clock.now(), events);
  }
  // Agents that its sensors show again must not be within its stopping distance.
  clear_stop_zone(robot, *state, state->injection_live && (jumped || !robot.injection_live));
  place_real_robot(robot, *state, jumped);
  if (jumped) constrain_near(robot.placed, agents, physics);
  move_real_body(robot, physics);
}

void Simulation::Parts::move_real_robots(RealRobotStates states) {
  for (std::size_t i = 0; i < real_robots.size(); ++i) {
    RealRobot& robot = real_robots[i];
    robot.jumped = false;
    move_real_robot(robot, states[i]);
    if (robot.twin) robot.grip.move_held(*robot.twin, robot.present, robot.jumped, agents, physics, clock.dt);
  }
}

void Simulation::Parts::step(RealRobotStates states, std::vector<LaserRequest>& requests) {
  const Surroundings around = surroundings();
  Building& building = *environment.building;
  ++clock.step;
  move_real_robots(states);
  environment.people.place(clock.now());

  // Decisions of agents.
  behaviours.search_routes(agents, around, events);
  neighbours.place(agents.size(), [this](std::size_t i) {
    return std::pair(agents[i].placed.center, agents[i].placed.bound);
  });
  drive_agents(agents, around, behaviours, forecast, physics, events);

  // Motion of bodies.
  environment.doors.move(building, agents, physics, clock.dt);
  physics.step();
  environment.doors.read(building, physics, clock.dt);
  observe_agents(agents, clock, physics, events);

  // Events.
  contacts.update(agents, real_robots, building, physics, clock.now(), events);
  pose_conflicts.update(real_robots, clock.now(), events);
  environment.people.report_contacts(agents, real_robots, clock.now(), events);
  grippers.update(agents, physics, clock, events);
  Grippers::update(real_robots, agents, physics, clock, events);
  watch_doors(environment.doors, contacts.touching(), around, physics, events);
  supervise(real_robots, agents, around, contacts, physics, predictor, events);
  hazards->update(around, events);

  recorder.record(clock, environment, real_robots, agents);
  request_scans(agents, clock.now(), requests);
}

void Simulation::step_robots(RealRobotStates real, std::vector<LaserRequest>& requests) {
  assert(real.size() == parts_->real_robots.size());
  parts_->step(real, requests);
}

void Simulation::step(const std::optional<RealRobotState>& real, std::vector<LaserRequest>& requests) {
  step_robots(RealRobotStates(&real, 1), requests);
}

void Simulation::wait() { parts_->clock.waiting = true; }
void Simulation::begin() { parts_->clock.begin(); }

void Simulation::skip(std::uint64_t steps) {
  parts_->clock.step += steps;
  parts_->recorder.record(parts_->clock, parts_->environment, parts_->real_robots, parts_->agents);
}

}  // namespace parhelion::simulation
