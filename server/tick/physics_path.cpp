#include "server/tick/physics_path.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdio>
#include <exception>
#include <numbers>

#include "server/tick/scan_learning.hpp"
#include "server/tick/state.hpp"

namespace parhelion::tick {
namespace {

/// The real robot's state for the simulation at an instant; none if the pose is not known.
std::optional<simulation::RealRobotState> real_robot_at(SimulationTime t, PoseState& pose,
                                                        const InjectionState& injection) {
  if (!pose.clock.known()) return std::nullopt;
  const auto at_t = robot_pose(pose, pose.clock.to_sensor(t), &pose.why_unknown);
  if (!at_t) return std::nullopt;
  simulation::RealRobotState real;
  real.T_map_base = at_t->T_map_base;
  real.attitude_known = at_t->attitude_known;
  real.twist = at_t->twist;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> position(at_t->covariance.topLeftCorner<2, 2>());
  real.sigma = std::sqrt(std::max(0.0, position.eigenvalues()(1)));
  real.relocalized = pose.relocalized;
  real.injection_live = injection_is_live(injection, t);
  return real;
}

/// Why the pose of a real robot is not known at this step.
std::string why_lost(SimulationTime now, const PoseState& pose) {
  const auto silence = pose.clock.known() ? pose.track.silence(pose.clock.to_sensor(now))
                                          : std::optional<pose::PoseTrack::Silence>();
  if (!silence || pose.why_unknown != pose::NoPose::slam_silent) return to_string(pose.why_unknown);
  char text[160];
  std::snprintf(
      text, sizeof text,
      "no estimate from SLAM for %.1f s, in which the robot moved %.2f m away and turned %.0f degrees",
      silence->time.seconds(), silence->distance, silence->angle * 180 / std::numbers::pi);
  return text;
}

/// A pose is unknown at once where odometry is old; only a loss of some duration is an event, as scans and
/// odometry of many robots have gaps.
void report_pose_changes(const TickContext& context, PoseState& pose) {
  constexpr Duration reported = milliseconds(300);
  const bool known = pose.at_this_step.has_value();
  if (known) pose.unknown_since.reset();
  if (known == pose.known) return;
  if (!known) {
    if (!pose.unknown_since) pose.unknown_since = context.now;
    if (context.now - *pose.unknown_since < reported) return;
  }
  pose.known = known;
  Event event;
  event.stamp = context.now;
  event.kind = known ? EventKind::localized : EventKind::localization_lost;
  event.subject = context.robot().name;
  if (known) {
    event.position = pose.at_this_step->T_map_base.translation();
  } else if (!is_exact(context.configuration.scenario)) {
    event.text = why_lost(context.now, pose);
  }
  publish_event(context, event);
}

/// People in the newest depth image of a camera.
void watch_depth(const TickContext& context, RobotState& robot, std::size_t index, State& state) {
  const auto& description = context.robot().depth_at(index);
  if (!description) return;
  const CameraState& camera = index == 0 ? robot.camera : robot.further_cameras[index - 1];
  const DepthPeoplePath path = state.depth_people_path(robot, index);
  if (camera.depth) find_people_in_depth(context, *description, *camera.depth, path);
  forget_old_people_in_depth(context, path);
}

/// Sets the robot's state for the step.
void update_robot(const TickContext& context, RobotState& robot, State& state) {
  robot.pose.at_this_step = is_exact(context.configuration.scenario)
                                ? trainee_state(context.configuration, state.simulation)
                                : real_robot_at(context.now, robot.pose, robot.injection);
  state.real[robot.index] = robot.pose.at_this_step;
  move_twin(context, robot.pose.clock, robot.encoders, state.simulation);
  report_pose_changes(context, robot.pose);
  for (std::size_t i = 0; i <= robot.further_lasers.size(); ++i) {
    forget_old_obstacles(context, i == 0 ? robot.scan : robot.further_lasers[i - 1].scan, state.simulation);
    forget_old_people(context, state.people_path(robot, i));
  }
  for (std::size_t i = 0; i <= robot.further_cameras.size(); ++i) watch_depth(context, robot, i, state);
}

void step_physics(const TickContext& context, State& state) {
  for (RobotState& robot : state.robots) update_robot(context.of_robot(robot.index), robot, state);
  state.lasers.requests.clear();
  if (simulates_trainee(context.configuration.scenario)) {
    state.simulation.step(std::nullopt, state.lasers.requests);
  } else {
    state.simulation.step_robots(state.real, state.lasers.requests);
  }
  for (RobotState& robot : state.robots) robot.pose.relocalized = false;
  ++state.world.steps;
}

/// What time alone brings about for one robot.
void watch_robot(const TickContext& context, RobotState& robot, State& state) {
  watch_silence(context, state.command_path(robot));
  report_gate_changes(context, robot.injection.gate);
  watch_injection(context, robot.injection);
  for (FurtherLaser& laser : robot.further_lasers) watch_injection(context, laser.injection);
  for (std::size_t i = 0; i <= robot.further_cameras.size(); ++i)
    answer_overdue_images(context, state.camera_path(robot, i));
}

void step_once(const Configuration& configuration, State& state, Outputs& outputs, StageObserver& stages) {
  const TickContext context = state.context(configuration, state.simulation.next_step(), outputs);
  step_physics(context, state);
  stages.ended(Stage::physics_step);
  publish_simulation_events(context, state.simulation);
  watch_start(context, state.real, state.start_path());
  if (!state.waiting) run_scripts(context, state.script_path());
  update_faults(context, state.faults, state.simulation);
  publish_agent_scans(context, state.site.caster, state.simulation, state.lasers);
  for (RobotState& robot : state.robots)
    if (robot.sensors) publish_sensors(context.of_robot(robot.index), state.sensor_path(robot));
  capture_agent_images(context, state.simulation, state.site, state.agent_cameras);
  for (RobotState& robot : state.robots) watch_robot(context.of_robot(robot.index), robot, state);
  watch_operators(context, state.operator_path(context));
  publish_world(context, state.simulation, state.world);
  for (RobotState& robot : state.robots)
    publish_hazards(context.of_robot(robot.index), robot.pose.clock, state.simulation, state.world,
                    state.waiting, robot.hazard_meters);
  stages.ended(Stage::agents);
}

}  // namespace

void advance(const Configuration& configuration, ArrivalTime until, State& state, Outputs& outputs,
             StageObserver& stages) {
  while (state.simulation.next_step() <= simulation_time(until)) {
    const SimulationTime due = state.simulation.next_step();
    try {
      step_once(configuration, state, outputs, stages);
    } catch (const std::exception& fault) {
      // Continues with the next step immediately: the result must not depend on how often this function is
      // called.
      refuse(state.context(configuration, due, outputs), {std::string("physics: ") + fault.what()});
      if (state.simulation.next_step() == due) state.simulation.skip(1);
    }
  }
}

}  // namespace parhelion::tick
