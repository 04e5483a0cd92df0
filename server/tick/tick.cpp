#include "server/tick/tick.hpp"

#include <algorithm>
#include <exception>

#include "protocols/codec.hpp"
#include "server/tick/foreign_publisher.hpp"

namespace parhelion::tick {
namespace {

/// Does the newest step due by then, skips the `count` before it, and first does all earlier ones, which a
/// live server did on its timer without a log entry.
void skip_steps(const Configuration& configuration, const Message& input, std::uint64_t count, State& state,
                Outputs& outputs, StageObserver& stages) {
  const SimulationTime until = simulation_time(input.arrival);
  const std::uint64_t due = state.simulation.steps_due(until);
  if (due > 1 && due - 1 > count) {
    const ArrivalTime fell_behind{state.simulation.after(due - 1 - count).ns};
    advance(configuration, fell_behind, state, outputs, stages);
  }
  state.simulation.skip(std::min(count, state.simulation.steps_due(until)));
}

/// LOOP: repeats a live server's decision that depended on wall time.
void apply_loop_record(const Configuration& configuration, const Message& input, State& state,
                       Outputs& outputs, StageObserver& stages) {
  const TickContext context = state.context(configuration, simulation_time(input.arrival), outputs);
  LoopDecision decision;
  if (const Status read = decode(input.channel, input.payload, decision); !read)
    return refuse(context, read.error());
  using Kind = LoopDecision::Kind;
  // Annotations of a result, read ahead by replay. The live server did no step for them, and might skip the
  // steps that were due by then.
  if (decision.kind == Kind::guard_fired || decision.kind == Kind::frame_dropped) return;
  const auto count = static_cast<std::uint64_t>(decision.count);
  if (decision.kind == Kind::steps_skipped) skip_steps(configuration, input, count, state, outputs, stages);
  // Earlier steps are independent of the decision: a live server did some of them on its timer before it.
  advance(configuration, input.arrival, state, outputs, stages);
  switch (decision.kind) {
    case Kind::scans_left_out:
      state.tally.scans_left_out += count;
      state.tally.scans_in += count;
      state.tally.scans_of_real_lasers += count;
      state.tally.scans_out += count;
      state.tally.scans_degraded[static_cast<std::size_t>(Degraded::guard)] += count;
      return;
    case Kind::foreign_message:
      return report_foreign_message(context, decision.count);
    case Kind::refused_message:
      return report_refused_message(context, decision.count);
    case Kind::stale_command:
      return refuse_stale_command(context, milliseconds(decision.count));
    case Kind::late_command:
      return refuse_late_command(context, count);
    case Kind::ended:
      if (state.grading) close_grading(context, *state.grading);
      return;
    case Kind::steps_skipped:
    case Kind::guard_fired:
    case Kind::frame_dropped:
      return;
  }
}

/// Whose input it is, beside the context's robot.
struct InputSource {
  std::string_view agent;  ///< of agent_teleop and agent_joint_command
  std::size_t sensor = 0;  ///< of scan, camera and depth
};

/// Passes the input to the path of its kind, of the context's robot.
void handle_input(const TickContext& context, InputKind kind, const InputSource& source, const Message& input,
                  State& state, ScanSink& sink, StageObserver& stages) {
  RobotState& robot = state.robots[context.robot_index];
  switch (kind) {
    case InputKind::scan:
      if (source.sensor == 0 && has_form_of_scan(input.payload)) robot.scan_silence.add(context.now);
      return process_scan(context, input, state.scan_path(robot, source.sensor), sink, stages);
    case InputKind::odometry:
      return handle_odometry(context, input, robot.pose);
    case InputKind::pose_cov:
      return handle_pose_estimate(context, input, state.site, state.simulation, robot.sensors.get(),
                                  robot.pose);
    case InputKind::pose:
      return handle_pose(context, input, robot.pose);
    case InputKind::imu:
      return handle_imu(context, input, robot.pose);
    case InputKind::joint_state:
      if (const Status read = handle_joint_state(context, input, robot.pose); !read)
        return doubt_encoders(read.error(), robot.encoders);
      return take_encoders(context, robot.pose.joint_state, robot.encoders);
    case InputKind::lines:
      return handle_line(context, input, robot.scan);
    case InputKind::camera:
      return handle_image(context, input, state.camera_path(robot, source.sensor));
    case InputKind::depth:
      return handle_depth(context, input, state.camera_path(robot, source.sensor));
    case InputKind::teleop:
      start_on_command(context, kind, robot.name, input, state.start_path());
      return handle_teleop(context, input, state.command_path(robot));
    case InputKind::joint_command:
      start_on_command(context, kind, robot.name, input, state.start_path());
      return handle_joint_command(context, input, state.command_path(robot));
    case InputKind::operators:
      return handle_operator(context, input, state.operator_path(context));
    case InputKind::command:
    case InputKind::emergency_stop:
      return handle_instructor_command(context, input, state.instructor_path());
    case InputKind::agent_teleop:
      start_on_command(context, kind, std::string(source.agent), input, state.start_path());
      return handle_agent_teleop(context, input, source.agent, state.simulation);
    case InputKind::agent_joint_command:
      start_on_command(context, kind, std::string(source.agent), input, state.start_path());
      return handle_agent_joint_command(context, input, source.agent, state.simulation);
    case InputKind::model:
      return handle_model(context, input, state.site, state.doors, state.simulation);
    case InputKind::robot:  // read before the session started; a change needs a new session
    case InputKind::loop:   // handled by tick()
    case InputKind::none:
      return;
  }
}

}  // namespace

void tick(const Configuration& configuration, const Message& input, State& state, Outputs& outputs,
          StageObserver& stages, ScanSink& sink) {
  InputSource source;
  std::size_t robot = 0;
  const InputKind kind = configuration.channels.kind(input.channel, &source.agent, &robot, &source.sensor);
  if (kind == InputKind::loop) return apply_loop_record(configuration, input, state, outputs, stages);
  advance(configuration, input.arrival, state, outputs, stages);
  stages.ended(Stage::physics_wait);
  const TickContext context = state.context(configuration, simulation_time(input.arrival), outputs, robot);
  try {
    handle_input(context, kind, source, input, state, sink, stages);
  } catch (const std::exception& fault) {
    refuse(context, {input.channel + ": " + fault.what()});
  }
}

void tick(const Configuration& configuration, const Message& input, State& state, Outputs& outputs,
          StageObserver& stages) {
  DeferredScanSink with_outputs;
  tick(configuration, input, state, outputs, stages, with_outputs);
}

void finish(const Configuration& configuration, State& state, Outputs& outputs) {
  const TickContext context = state.context(configuration, state.simulation.now(), outputs);
  for (RobotState& robot : state.robots) {
    const TickContext own = context.of_robot(robot.index);
    for (std::size_t i = 0; i <= robot.further_cameras.size(); ++i)
      answer_waiting_images(own, state.camera_path(robot, i));
    stop_robot(own, state.command_path(robot));
  }
}

}  // namespace parhelion::tick
