#include "server/tick/tick.hpp"

#include <algorithm>
#include <exception>

#include "server/tick/grading_path.hpp"
#include "server/tick/sensor_path.hpp"

namespace parhelion::tick {
namespace {

void take_odometry(const Message& input, State& state) {
  Odometry odometry;
  if (const Status read = decode(input.channel, input.payload, odometry); !read)
    return refuse(read.error(), state);
  if (state.robot_clock.add(input.arrival, odometry.stamp)) state.track.add(odometry);
}

void take_imu(const Message& input, State& state) {
  ImuSample sample;
  if (const Status read = decode(input.channel, input.payload, sample); !read)
    return refuse(read.error(), state);
  if (state.robot_clock.add(input.arrival, sample.stamp)) state.attitude.add(sample);
}

/// Nothing of the tick's: the newest is for whoever maps.
void take_line(const Configuration& configuration, const Message& input, State& state) {
  if (!configuration.robot.line_laser)
    return refuse({input.channel + ": the robot description has no 'line_laser'"}, state);
  Scan line;
  if (const Status read = decode(input.channel, input.payload, line); !read)
    return refuse(read.error(), state);
  state.line = std::move(line);
}

void take_joint_state(const Message& input, State& state) {
  constexpr std::size_t most_joints = 256;
  Joints& joints = state.joint_state;
  if (const Status read = decode(input.channel, input.payload, joints); !read)
    return refuse(read.error(), state);
  if (!state.robot_clock.add(input.arrival, joints.stamp)) return;
  state.joints.add(joints);
  for (std::size_t i = 0; i < joints.positions.size(); ++i) {
    auto known = state.joint_positions.find(joints.names[i]);
    if (known == state.joint_positions.end()) {
      if (state.joint_positions.size() == most_joints) continue;
      known = state.joint_positions.try_emplace(joints.names[i]).first;
    }
    known->second = {joints.positions[i], simulation_time(input.arrival)};
  }
}

void take_estimate(const Configuration& configuration, const Message& input, const PoseEstimate& estimate,
                   State& state, Outputs& outputs) {
  if (!state.robot_clock.known()) state.robot_clock.add(input.arrival, estimate.stamp);
  if (state.track.add(estimate) != pose::PoseTrack::Correction::relocalization) return;
  // A simulated robot that tips over has not been lost: its own pose is exact.
  if (state.sensors && !configuration.scenario.trainee->slam) return;
  state.relocalized = true;
  Event event;
  event.stamp = simulation_time(input.arrival);
  event.kind = EventKind::relocalized;
  event.subject = configuration.robot.name;
  event.position = estimate.T_map_base.translation();
  publish_event(configuration, event, state, outputs);
}

/// POSE says no covariance: the scenario does. Whoever sends it is taken to be sure of it while it comes.
void take_plain_pose(const Configuration& configuration, const Message& input, State& state,
                     Outputs& outputs) {
  PoseStamped pose;
  if (const Status read = decode(input.channel, input.payload, pose); !read)
    return refuse(read.error(), state);
  const PoseInput& known = *configuration.scenario.pose;
  PoseEstimate estimate;
  estimate.stamp = pose.stamp;
  estimate.T_map_base = pose.T_map_base;
  estimate.covariance.diagonal().head<3>().setConstant(known.position_sigma * known.position_sigma);
  estimate.covariance.diagonal().tail<3>().setConstant(known.yaw_sigma * known.yaw_sigma);
  estimate.map_id = known.map_id.empty() ? configuration.model.map_id : known.map_id;
  estimate.state = SlamState::tracking;
  take_estimate(configuration, input, estimate, state, outputs);
}

void take_pose(const Configuration& configuration, const Message& input, State& state, Outputs& outputs) {
  PoseEstimate estimate;
  if (const Status read = decode(input.channel, input.payload, estimate); !read)
    return refuse(read.error(), state);
  if (estimate.step_time.ns > 0)
    state.tally.slam_us.add(estimate.step_time.microseconds());  // 0: not measured
  if (!estimate.causal)
    return refuse({input.channel + ": a pose that was computed with later data is never injected with"},
                  state);
  if (configuration.scenario.trainee && configuration.scenario.trainee->slam)
    take_slam_word(configuration, estimate, state);
  take_estimate(configuration, input, estimate, state, outputs);
}

/// Of the steps due by then the newest is done, the `count` before it are skipped, and all earlier ones are
/// done first: a live server did those on its timer, which no log shows.
void skip_steps(const Configuration& configuration, const Message& input, std::uint64_t count, State& state,
                Outputs& outputs, StageObserver& observer) {
  const SimulationTime until = simulation_time(input.arrival);
  const std::uint64_t due = state.simulation.steps_due(until);
  if (due > 1 && due - 1 > count) {
    const ArrivalTime fell_behind{state.simulation.after(due - 1 - count).ns};
    advance(configuration, fell_behind, state, outputs, observer);
  }
  state.simulation.skip(std::min(count, state.simulation.steps_due(until)));
}

/// What only wall time could decide in a live server is decided in the same way again.
void obey(const Configuration& configuration, const Message& input, State& state, Outputs& outputs,
          StageObserver& observer) {
  LoopDecision decision;
  if (const Status read = decode(input.channel, input.payload, decision); !read)
    return refuse(read.error(), state);
  const auto count = static_cast<std::uint64_t>(decision.count);
  switch (decision.kind) {
    case LoopDecision::Kind::guard_fired:
    case LoopDecision::Kind::frame_dropped:
      // Notes on an answer, read ahead by who replays. The live server did no step for them, and might skip
      // the steps that were due by then.
      return;
    case LoopDecision::Kind::steps_skipped:
      skip_steps(configuration, input, count, state, outputs, observer);
      break;
    case LoopDecision::Kind::scans_left_out:
      // Steps until then know nothing of it: a live server did some of them on its timer, before it decided.
      advance(configuration, input.arrival, state, outputs, observer);
      state.tally.scans_left_out += count;
      state.tally.scans_in += count;
      state.tally.scans_out += count;
      state.tally.scans_degraded[static_cast<std::size_t>(Degraded::guard)] += count;
      return;
    case LoopDecision::Kind::foreign_message:
      advance(configuration, input.arrival, state, outputs, observer);
      return note_foreign_message(configuration, simulation_time(input.arrival), decision.count, state,
                                  outputs);
    case LoopDecision::Kind::ended:
      advance(configuration, input.arrival, state, outputs, observer);
      return close_grading(configuration, simulation_time(input.arrival), state, outputs);
  }
  advance(configuration, input.arrival, state, outputs, observer);
}

}  // namespace

void take_input(const Configuration& configuration, InputKind kind, std::string_view agent,
                const Message& input, State& state, Outputs& outputs, StageObserver& observer) {
  switch (kind) {
    case InputKind::scan:
      return answer_scan(configuration, input, state, outputs, observer);
    case InputKind::odometry:
      return take_odometry(input, state);
    case InputKind::pose_cov:
      return take_pose(configuration, input, state, outputs);
    case InputKind::pose:
      return take_plain_pose(configuration, input, state, outputs);
    case InputKind::imu:
      return take_imu(input, state);
    case InputKind::joint_state:
      return take_joint_state(input, state);
    case InputKind::joint_command:
      return answer_joint_command(configuration, input, state, outputs);
    case InputKind::camera:
      return answer_image(configuration, input, state, outputs);
    case InputKind::depth:
      return take_depth(configuration, input, state, outputs);
    case InputKind::lines:
      return take_line(configuration, input, state);
    case InputKind::teleop:
      return answer_teleop(configuration, input, state, outputs);
    case InputKind::command:
    case InputKind::emergency_stop:
      return process_command(configuration, input, state, outputs);
    case InputKind::agent_teleop:
      return drive_agent(configuration, input, agent, state);
    case InputKind::model:
      return change_model(configuration, input, state, outputs);
    case InputKind::operators:
      return take_operator_word(configuration, input, state, outputs);
    case InputKind::robot:  // read before the session started; a change needs a new session
    case InputKind::loop:   // obeyed by tick
    case InputKind::none:
      return;
  }
}

void tick(const Configuration& configuration, const Message& input, State& state, Outputs& outputs,
          StageObserver& observer) {
  std::string_view agent;
  const InputKind kind = configuration.channels.kind(input.channel, &agent);
  if (kind == InputKind::loop) return obey(configuration, input, state, outputs, observer);
  advance(configuration, input.arrival, state, outputs, observer);
  observer.ended(Stage::physics_wait);
  try {
    take_input(configuration, kind, agent, input, state, outputs, observer);
  } catch (const std::exception& fault) {
    refuse({input.channel + ": " + fault.what()}, state);
  }
}

void refuse(const Error& error, State& state) {
  ++state.tally.refused_inputs;
  state.tally.last_refusal = error.message;
}

}  // namespace parhelion::tick
