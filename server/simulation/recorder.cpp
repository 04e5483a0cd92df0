#include "server/simulation/recorder.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/simulation/robots/base_body.hpp"

namespace parhelion::simulation {
namespace {

/// rad from a to b; all parts of an agent turn about its y axis (part_poses).
double turned_about_y(const Transform<Base, Body>& a, const Transform<Base, Body>& b) {
  const auto &from = a.isometry().linear(), &to = b.isometry().linear();
  const double sine = to(0, 2) * from(0, 0) - to(0, 0) * from(0, 2);
  const double cosine = to(0, 0) * from(0, 0) + to(0, 2) * from(0, 2);
  return sine == 0 && cosine > 0 ? 0 : std::atan2(sine, cosine);
}

BodyState body_state(BodyId id, std::uint32_t epoch, const RigidState& rigid) {
  return {id, epoch, rigid.T_map_body, rigid.velocity, rigid.rotation_rate, true, true};
}

/// Doors have ids of the building: they come first in a record, and among its bodies here.
void place_doors(const std::vector<BodyState>& fixed, std::vector<BodyState>& bodies) {
  const auto first = bodies.begin() + static_cast<std::ptrdiff_t>(fixed.size());
  auto door = first;
  for (; !fixed.empty() && door != bodies.end() && door->id <= fixed.back().id; ++door) {
    const auto at = std::lower_bound(fixed.begin(), fixed.end(), door->id,
                                     [](const BodyState& body, BodyId id) { return body.id < id; });
    bodies[static_cast<std::size_t>(at - fixed.begin())] = *door;
  }
  bodies.erase(first, door);
}

}  // namespace

void Recorder::rebuild_scene(const Environment& environment, const RealRobots& real_robots,
                             const Agents& agents) {
  auto next = std::make_shared<Scene>();
  next->version = scene_ ? scene_->version + 1 : 1;
  next->bodies = environment.building->definitions();
  for (const RealRobot& robot : real_robots)
    next->bodies.insert(next->bodies.end(), robot.definitions.begin(), robot.definitions.end());
  next->bodies.insert(next->bodies.end(), agents.definitions().begin(), agents.definitions().end());
  for (const PlacedPerson& person : environment.people.placed()) next->bodies.push_back(person.definition);
  scene_ = std::move(next);
}

/// A part's own velocity is the difference of its last two poses in the agent's frame, added to the agent's
/// motion.
void Recorder::append_states(Agent& agent, double dt, std::vector<BodyState>& bodies) {
  if (agent.robot) {
    agent.robot->append_states(agent.first_body, agent.epoch, bodies);
    return;
  }
  if (agent.cable) {
    agent.cable->append_states(agent.first_body, agent.epoch, bodies);
    return;
  }
  bodies.push_back(body_state(agent.first_body, agent.epoch, agent.rigid));
  if (agent.body_count == 1) return;
  poses_.clear();
  part_poses(agent.definition, agent.parts, poses_);
  const Transform<Map, Base> T_map_base = base_of(agent.rigid.T_map_body);
  const bool first = agent.part_epoch != agent.epoch || agent.part_poses.size() != poses_.size();
  const Eigen::Matrix3d R = T_map_base.rotation();
  bodies.pop_back();
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    BodyState state;
    state.id = agent.first_body + static_cast<BodyId>(i);
    state.epoch = agent.epoch;
    state.T_map_body = T_map_base * poses_[i];
    const Eigen::Vector3d arm = R * poses_[i].translation();
    state.velocity = agent.rigid.velocity + agent.rigid.rotation_rate.cross(arm);
    state.rotation_rate = agent.rigid.rotation_rate;
    if (!first) {
      const Transform<Base, Body>& before = agent.part_poses[i];
      state.velocity += R * (poses_[i].translation() - before.translation()) / dt;
      state.rotation_rate += R.col(1) * (turned_about_y(before, poses_[i]) / dt);
    }
    bodies.push_back(state);
  }
  agent.part_epoch = agent.epoch;
  agent.part_poses.swap(poses_);
}

void Recorder::record(const StepClock& clock, const Environment& environment, const RealRobots& real_robots,
                      Agents& agents) {
  HistoryRecord& record = history_.push();
  record.stamp = clock.now();
  record.step = clock.step;
  record.scene = scene_;
  record.building = environment.building;
  std::size_t of_robots = 0;
  for (const RealRobot& robot : real_robots) of_robots += robot.definitions.size();
  record.bodies.reserve(environment.doors.all().size() + of_robots + agents.definitions().size());
  environment.doors.append_states(record.bodies);
  for (const RealRobot& robot : real_robots) simulation::append_states(robot, record.bodies);
  for (Agent& agent : agents) append_states(agent, clock.dt, record.bodies);
  for (const PlacedPerson& person : environment.people.placed()) {
    const Eigen::Vector2d& p = person.disc.center;
    record.bodies.push_back(
        {person.definition->id,
         0,
         Transform<Map, Body>::planar(p.x(), p.y(), person.yaw, environment.building->floor_height(p)),
         {person.velocity.x(), person.velocity.y(), 0}});
  }
}

bool Recorder::at(SimulationTime t, Duration ahead, WorldSnapshot& snapshot) const {
  const HistoryRecord* record = history_.record_at(t, ahead);
  if (!record) return false;
  // In the building only doors move: the other states of an earlier call for this scene are still valid.
  const std::vector<BodyState>& fixed = record->building->states();
  if (snapshot.scene != record->scene || snapshot.bodies.size() < fixed.size()) {
    snapshot.bodies.assign(fixed.begin(), fixed.end());
  } else {
    snapshot.bodies.resize(fixed.size());
    for (const std::size_t door : record->building->door_bodies()) snapshot.bodies[door] = fixed[door];
  }
  history_.find(t, ahead, snapshot.bodies);
  place_doors(fixed, snapshot.bodies);
  snapshot.stamp = t;
  snapshot.step = record->step;
  snapshot.scene = record->scene;
  return true;
}

}  // namespace parhelion::simulation
