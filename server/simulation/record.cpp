// What is kept of a step: where each body is and how it moves, from the physics into the history and out of
// it.
#include <algorithm>
#include <cmath>
#include <utility>

#include "server/simulation/state.hpp"

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
  return {id, epoch, rigid.T_map_body, rigid.velocity, rigid.rotation_rate, true};
}

/// Doors have numbers of the building: they come before all else in a record, and among its bodies here.
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

void Simulation::State::rebuild_scene() {
  auto next = std::make_shared<Scene>();
  next->version = scene ? scene->version + 1 : 1;
  next->bodies = building->definitions();
  next->bodies.push_back(real_definition);
  next->bodies.insert(next->bodies.end(), agent_definitions.begin(), agent_definitions.end());
  scene = std::move(next);

  // Scratch for the worst case, so that a crowd that gathers later allocates nothing.
  const std::size_t movers = agents.size() + 2;
  near.reserve(4 * building->obstacles().size());
  nearby.reserve(4 * movers + 64);
  steering.obstacles.reserve(building->obstacles().size() + movers + 512);
  while (steering.predicted.size() < movers) steering.predicted.push_back(make_segment({0, 0}, {0, 0}, 0));
}

/// A part's own velocity is the difference of its last two poses in the agent's frame, on top of the agent's
/// motion.
void Simulation::State::append_states(Agent& agent, std::vector<BodyState>& bodies) {
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
  poses.clear();
  part_poses(agent.definition, agent.parts, poses);
  const Transform<Map, Base> T_map_base(agent.rigid.T_map_body.isometry());
  const bool first = agent.part_epoch != agent.epoch || agent.part_poses.size() != poses.size();
  const Eigen::Matrix3d R = T_map_base.rotation();
  bodies.pop_back();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    BodyState state;
    state.id = agent.first_body + static_cast<BodyId>(i);
    state.epoch = agent.epoch;
    state.T_map_body = T_map_base * poses[i];
    const Eigen::Vector3d arm = R * poses[i].translation();
    state.velocity = agent.rigid.velocity + agent.rigid.rotation_rate.cross(arm);
    state.rotation_rate = agent.rigid.rotation_rate;
    if (!first) {
      const Transform<Base, Body>& before = agent.part_poses[i];
      state.velocity += R * (poses[i].translation() - before.translation()) / dt;
      state.rotation_rate += R.col(1) * (turned_about_y(before, poses[i]) / dt);
    }
    bodies.push_back(state);
  }
  agent.part_epoch = agent.epoch;
  agent.part_poses.swap(poses);
}

void Simulation::State::observe_cable(Agent& agent) {
  if (!agent.cable->observe(physics)) return;
  agent.pose = planar_pose(Transform<Map, Base>(agent.rigid.T_map_body.isometry()));
  std::vector<Eigen::Vector2d> corners;
  const double r = agent.cable->form().radius;
  for (const Eigen::Vector3d& p : agent.cable->points()) {
    for (int corner = 0; corner < 4; ++corner)
      corners.emplace_back(p.x() + (corner & 1 ? r : -r), p.y() + (corner & 2 ? r : -r));
  }
  agent.placed = make_polygon(convex_hull(std::move(corners)));
}

void Simulation::State::record() {
  HistoryRecord& record = history.push();
  record.stamp = stamp_of(step);
  record.step = step;
  record.scene = scene;
  record.attitude_known = real.present && real.last.attitude_known;
  record.building = building;
  record.bodies.reserve(doors.size() + 1 + agent_definitions.size());
  record_doors(record.bodies);
  if (real.present) {
    const Eigen::Isometry3d& base = real.last.T_map_base.isometry();
    const Eigen::Vector3d velocity =
        base.linear() * Eigen::Vector3d(real.last.twist.vx, real.last.twist.vy, 0);
    record.bodies.push_back({real.id, real.epoch, Transform<Map, Body>(base), velocity,
                             base.linear() * Eigen::Vector3d(0, 0, real.last.twist.wz), true});
  }
  for (const auto& agent : agents) append_states(*agent, record.bodies);
}

bool Simulation::at(SimulationTime t, WorldSnapshot& snapshot) const {
  const Duration ahead = next_step() - now();
  const HistoryRecord* record = state_->history.record_at(t, ahead);
  if (!record) return false;
  // Of the building only doors move: what an earlier call wrote for this scene is still right.
  const std::vector<BodyState>& fixed = record->building->states();
  if (snapshot.scene != record->scene || snapshot.bodies.size() < fixed.size()) {
    snapshot.bodies.assign(fixed.begin(), fixed.end());
  } else {
    snapshot.bodies.resize(fixed.size());
    for (const std::size_t door : record->building->door_bodies()) snapshot.bodies[door] = fixed[door];
  }
  state_->history.find(t, ahead, snapshot.bodies);
  place_doors(fixed, snapshot.bodies);
  snapshot.stamp = t;
  snapshot.step = record->step;
  snapshot.scene = record->scene;
  snapshot.attitude_known = record->attitude_known;
  return true;
}

}  // namespace parhelion::simulation
