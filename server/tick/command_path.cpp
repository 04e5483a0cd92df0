#include "server/tick/command_path.hpp"

#include <algorithm>
#include <utility>

#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/driving_timing.hpp"

namespace parhelion::tick {
namespace {

/// The server's own reason to stop a real robot.
std::optional<simulation::SpeedLimitReason> reason_to_stop(const TickContext& context,
                                                           const CommandPath& path) {
  if (path.command.drivers.conflict(context.now)) return simulation::SpeedLimitReason::two_drivers;
  if (!simulates_trainee(context.configuration.scenario) && path.scans.silent(context.now))
    return simulation::SpeedLimitReason::scans_silent;
  return std::nullopt;
}

/// The motion currently allowed by the newest TELEOP and its age.
simulation::VirtualContactResult limit_now(const TickContext& context, const CommandPath& path) {
  const Configuration& configuration = context.configuration;
  const RobotDescription& robot = context.robot();
  const CommandState& command = path.command;
  simulation::VirtualContactInput input;
  input.teleop = command.teleop;
  input.teleop_age = context.now - simulation_time(command.teleop_arrival);
  input.pose_known = path.pose.at_this_step.has_value();
  input.localization_lost = !path.pose.known && !is_exact(configuration.scenario);
  input.emergency_stop = command.emergency_stop;
  input.stop = reason_to_stop(context, path);
  input.own_stop = command.own_stop;
  if (command.teleop && path.pose.at_this_step) {
    const Twist2& asked = command.teleop->twist;
    const double scale = simulation::limits_scale(robot.limits, asked);
    const Twist2 twist{scale * asked.vx, scale * asked.vy, scale * asked.wz};
    const double lookahead = simulation::contact_lookahead(configuration.scenario.contact, robot, twist);
    // A simulated robot is limited by the physics.
    if (simulates_trainee(configuration.scenario)) {
      input.clearance.distance = lookahead;
    } else {
      input.clearance = path.simulation.clearance(path.pose.at_this_step->T_map_base, twist, lookahead,
                                                  context.robot_index);
      // An arm may come up to a thing: that is how it takes it.
      const double arm = input.clearance.arm_distance + configuration.scenario.contact.stop_distance;
      input.clearance.distance = std::min(input.clearance.distance, arm);
    }
  }
  return simulation::limit(configuration.scenario.contact, robot, input, path.command.contact);
}

void report_speed_limit(const TickContext& context, simulation::SpeedLimitReason reason,
                        CommandState& command) {
  if (reason == command.speed_limit_reason) return;
  command.speed_limit_reason = reason;
  Event event;
  event.stamp = context.now;
  event.kind =
      reason == simulation::SpeedLimitReason::none ? EventKind::speed_limit_lifted : EventKind::speed_limited;
  event.subject = context.robot().name;
  event.pair = PairKind::real_virtual;
  event.text = to_string(reason);
  publish_event(context, event);
}

/// Publishes MR_CMD, and applies it to a simulated robot.
void send_command(const TickContext& context, const CommandPath& path) {
  const Configuration& configuration = context.configuration;
  simulation::VirtualContactResult result = limit_now(context, path);
  result.command.type = context.robot().command_type;
  path.command.last_command = context.now;
  encode(result.command, context.outputs.add(context.channel(channel::kMrCmd)));
  if (simulates_trainee(configuration.scenario))
    path.simulation.teleop(context.robot().name, result.command.twist);
  // Consoles are silent after a stop: not an event.
  const std::optional<TwistCommand>& teleop = path.command.teleop;
  const bool stopped = result.reason == simulation::SpeedLimitReason::silence &&
                       (!teleop || simulation::footprint_speed(context.robot(), teleop->twist) == 0);
  report_speed_limit(context, stopped ? simulation::SpeedLimitReason::none : result.reason, path.command);
}

/// A stop of the last commanded joints: no velocity, no effort, and the position from the encoders. Without
/// an encoder value no position is commanded.
Joints joint_stop(const TickContext& context, const CommandPath& path) {
  const JointPositions& encoders = path.pose.joint_positions;
  Joints stop = path.command.joint_command;
  stop.stamp = {context.now.ns};
  stop.velocities.assign(stop.names.size(), 0.0);
  std::fill(stop.efforts.begin(), stop.efforts.end(), 0.0);
  for (std::size_t i = 0; i < stop.positions.size(); ++i) {
    const auto measured = encoders.find(stop.names[i]);
    const bool fresh = measured != encoders.end() && (context.now - measured->second.second).seconds() <
                                                         context.configuration.scenario.contact.silence;
    if (!fresh) {
      stop.positions.clear();
      break;
    }
    stop.positions[i] = measured->second.first;
  }
  return stop;
}

void report_joint_limits(const TickContext& context, std::map<std::string, std::string> limited,
                         CommandState& command) {
  const auto publish = [&](EventKind kind, const std::string& joint, const std::string& why) {
    Event event;
    event.stamp = context.now;
    event.kind = kind;
    event.subject = context.robot().name;
    event.object = joint;
    event.pair = PairKind::real_virtual;
    event.text = why;
    publish_event(context, event);
  };
  for (const auto& [joint, why] : command.limited_joints)
    if (!limited.count(joint)) publish(EventKind::joint_limit_lifted, joint, {});
  for (const auto& [joint, why] : limited) {
    const auto before = command.limited_joints.find(joint);
    if (before == command.limited_joints.end() || before->second != why)
      publish(EventKind::joint_limited, joint, why);
  }
  command.limited_joints = std::move(limited);
}

/// Without the joints that the robot's model has not: where they would move to is not known.
Joints known_joints(const TickContext& context, const Joints& command, const simulation::RobotModel& model) {
  Joints known{command.stamp, {}, {}, {}, {}};
  for (std::size_t i = 0; i < command.names.size(); ++i) {
    const auto joint = std::find_if(model.joints.begin(), model.joints.end(),
                                    [&](const auto& each) { return each.name == command.names[i]; });
    if (joint == model.joints.end() || joint->geared) {
      refuse(context, {context.channel(channel::kJointCmd) + ": joint '" + command.names[i] +
                       (joint == model.joints.end() ? "' is not in robot model '" + model.name + "'"
                                                    : "' mimics another: command that one")});
      continue;
    }
    known.names.push_back(command.names[i]);
    if (!command.positions.empty()) known.positions.push_back(command.positions[i]);
    if (!command.velocities.empty()) known.velocities.push_back(command.velocities[i]);
    if (!command.efforts.empty()) known.efforts.push_back(command.efforts[i]);
  }
  return known;
}

/// A reduction never turns a motion round: a joint that is already beyond what is left of it stays there.
void stay_where_it_is(const Joints& asked, const EncoderState& state, Joints& allowed) {
  for (std::size_t i = 0; i < allowed.positions.size(); ++i) {
    if (allowed.positions[i] == asked.positions[i]) continue;
    const auto encoder = std::find_if(state.encoders.begin(), state.encoders.end(), [&](const Encoder& each) {
      return state.model->joints[each.joint].name == allowed.names[i];
    });
    if (encoder == state.encoders.end() || !encoder->newest) continue;
    const double is = encoder->newest->position;
    if ((allowed.positions[i] - is) * (asked.positions[i] - is) < 0) allowed.positions[i] = is;
  }
}

/// What virtual contact leaves of a joint command; a real robot without a robot model has no such contact.
Joints allowed_joints(const TickContext& context, const Joints& command, const CommandPath& path) {
  if (!path.encoders.exist()) return command;
  if (!path.encoders.fresh) {
    report_joint_limits(context, {{"", path.encoders.why}}, path.command);
    return joint_stop(context, path);
  }
  constexpr double kRepeated = 0.15;  // s until the next command
  const Joints asked = known_joints(context, command, *path.encoders.model);
  Joints allowed = asked;
  const double reaction = context.robot().limits.reaction_time;
  std::map<std::string, std::string> limited;
  for (auto& [joint, thing] : path.simulation.limit_joints(
           allowed, reaction + kRepeated, reaction + context.configuration.scenario.contact.silence,
           context.robot_index))
    limited[joint] = thing;
  stay_where_it_is(asked, path.encoders, allowed);
  report_joint_limits(context, std::move(limited), path.command);
  return allowed;
}

void publish_dead_man(const TickContext& context, EventKind kind, double value, DeadMan& dead_man) {
  dead_man.pressed = kind == EventKind::dead_man_pressed;
  Event event;
  event.stamp = context.now;
  event.kind = kind;
  event.subject = context.robot().name;
  event.value = value;
  publish_event(context, event);
}

/// TELEOP implies a pressed dead-man: consoles are silent while it is released.
void update_dead_man(const TickContext& context, ArrivalTime arrival, const Twist2& twist,
                     DeadMan& dead_man) {
  dead_man.received = arrival;
  const double speed = simulation::footprint_speed(context.robot(), twist);
  if (speed > 0) {
    dead_man.moved = arrival;
    dead_man.speed = speed;
  }
  // A stop command without an earlier motion does not count as pressing.
  if (!dead_man.pressed && speed > 0) publish_dead_man(context, EventKind::dead_man_pressed, 0, dead_man);
}

void watch_dead_man(const TickContext& context, DeadMan& dead_man) {
  if (!dead_man.pressed) return;
  const double silent = (context.now - simulation_time(dead_man.received)).seconds();
  if (silent < context.configuration.scenario.contact.silence) return;
  const bool moving =
      dead_man.moved && dead_man.received - *dead_man.moved <= driving_timing::kReleaseWhileDriving;
  publish_dead_man(context, EventKind::dead_man_released, moving ? dead_man.speed : 0, dead_man);
}

/// Commands do not reach a simulated robot out of radio range: the missing TELEOP stops it.
bool radio_reaches_robot(const Configuration& configuration, const simulation::Simulation& simulation) {
  return !simulates_trainee(configuration.scenario) ||
         !simulation.supply_of(configuration.robot.name).radio_lost;
}

/// Publishes MR_JOINT_CMD, and applies it to a simulated robot.
void send_joint_command(const TickContext& context, const Joints& command, const CommandPath& path) {
  const Configuration& configuration = context.configuration;
  path.command.last_joint_command = context.now;
  encode(command, context.outputs.add(context.channel(channel::kMrJointCmd)));
  const std::string& robot = context.robot().name;
  if (!simulates_trainee(configuration.scenario) || path.simulation.supply_of(robot).battery_empty) return;
  const Status done = path.simulation.joint_command(robot, command);
  if (!done) refuse(context, {context.channel(channel::kJointCmd) + ": " + done.error().message});
}

bool moves_nothing(const Joints& command) {
  const auto is_zero = [](double value) { return value == 0; };
  return command.positions.empty() &&
         std::all_of(command.velocities.begin(), command.velocities.end(), is_zero) &&
         std::all_of(command.efforts.begin(), command.efforts.end(), is_zero);
}

/// Does nothing if no joint was ever commanded.
void stop_joints(const TickContext& context, const CommandPath& path) {
  if (path.command.joint_command.names.empty()) return;
  report_joint_limits(context, {}, path.command);
  send_joint_command(context, joint_stop(context, path), path);
}

bool moves(const Twist2& twist) { return twist.vx != 0 || twist.vy != 0 || twist.wz != 0; }

/// A motion that the sender no longer means; counted as refused.
bool refuse_old_motion(const TickContext& context, const Message& input, SensorTime stamp,
                       CommandClock& clock) {
  const bool is_checked = !simulates_trainee(context.configuration.scenario) && stamp.ns != 0;
  if (!is_checked || clock.is_new(input.arrival, stamp)) return false;
  refuse(context, {input.channel + ": late, or with a stamp that does not advance: refused"});
  return true;
}

/// A command for a virtual robot. Error: it is the trainee's, which `canonical` commands, or the bytes.
template <class Command>
Result<Command> read_agent_command(const TickContext& context, const Message& input, std::string_view agent,
                                   const char* canonical) {
  const Configuration& configuration = context.configuration;
  if (simulates_trainee(configuration.scenario) && agent == configuration.robot.name)
    return Error{input.channel + ": this is the trainee's robot; send " +
                 configuration.channels.bus(canonical)};
  Command command;
  if (const Status read = decode(input.channel, input.payload, command); !read) return read.error();
  return command;
}

void report_two_drivers(const TickContext& context) {
  Event event;
  event.stamp = context.now;
  event.kind = EventKind::command_refused;
  event.subject = context.robot().name;
  event.text = "two consoles drive robot '" + context.robot().name +
               "' at once: it stands until one of them has stopped sending " +
               context.channel(channel::kTeleop) + " and the other has released its dead-man";
  publish_event(context, event);
}

/// Stops the robot at once where a reason begins, whenever the next TELEOP comes.
void watch_stops(const TickContext& context, const CommandPath& path) {
  CommandState& command = path.command;
  if (!command.teleop) {
    // Nobody has driven it since the first step.
    if (!command.watched_since) command.watched_since = context.now;
    const double silent = (context.now - *command.watched_since).seconds();
    if (silent >= context.configuration.scenario.contact.silence)
      command.contact.held = simulation::SpeedLimitReason::none;
    return;
  }
  const auto before = std::exchange(command.stop, reason_to_stop(context, path));
  if (!command.stop || command.stop == before) return;
  if (*command.stop == simulation::SpeedLimitReason::two_drivers) report_two_drivers(context);
  send_command(context, path);
}

}  // namespace

void handle_teleop(const TickContext& context, const Message& input, const CommandPath& path) {
  TwistCommand command;
  bool unreadable = false;
  if (const Status read = decode(input.channel, input.payload, command); !read) {
    refuse(context, read.error());
    command = {};  // an unreadable command is a stop, and no release
    unreadable = true;
  } else if (moves(command.twist) &&
             refuse_old_motion(context, input, command.stamp, path.command.teleop_clock)) {
    return;
  }
  update_dead_man(context, input.arrival, command.twist, path.command.dead_man);
  if (!radio_reaches_robot(context.configuration, path.simulation)) return;
  // What the robot cannot be told must not count in its clearance either.
  if (context.robot().command_type == CommandType::mbot_motor) command.twist.vy = 0;
  path.command.teleop = command;
  path.command.teleop_arrival = input.arrival;
  path.command.own_stop = unreadable;
  path.command.drivers.add(input.arrival, command.twist, context.robot());
  send_command(context, path);
}

void refuse_stale_command(const TickContext& context, Duration age) {
  refuse(context, {"a command for the robot was " + std::to_string(age.ns / 1'000'000) +
                   " ms old when the server processed it; refused above " +
                   std::to_string(driving_timing::kMaxQueueAge.ns / 1'000'000) + " ms"});
}

void stop_robot(const TickContext& context, const CommandPath& path) {
  if (!path.command.teleop) return;  // never moved
  path.command.teleop = TwistCommand{{context.now.ns}, {}};
  path.command.teleop_arrival = ArrivalTime{context.now.ns};
  path.command.own_stop = true;
  send_command(context, path);
  stop_joints(context, path);
}

void set_emergency_stop(const TickContext& context, bool stopped, const CommandPath& path) {
  CommandState& command = path.command;
  command.emergency_stop = stopped;
  command.joints_stopped = command.joints_stopped || stopped;
  // A robot that nobody drives by TELEOP may drive itself: it must stop, too.
  if (command.teleop || stopped) send_command(context, path);
  if (stopped) stop_joints(context, path);
}

void CommandState::begin(ArrivalTime start, bool real) {
  teleop_arrival = start;
  if (real) contact.held = simulation::SpeedLimitReason::not_released;
}

void watch_silence(const TickContext& context, const CommandPath& path) {
  CommandState& command = path.command;
  watch_dead_man(context, command.dead_man);
  watch_stops(context, path);
  const auto silent = [&](ArrivalTime last, SimulationTime sent) {
    return context.now - sent >= driving_timing::kStopPeriod &&
           (context.now - simulation_time(last)).seconds() >= context.configuration.scenario.contact.silence;
  };
  const bool answers = command.teleop || command.emergency_stop;
  if (answers && silent(command.teleop_arrival, command.last_command)) send_command(context, path);
  if (silent(command.joint_command_arrival, command.last_joint_command)) stop_joints(context, path);
  const bool blind = path.encoders.exist() && !path.encoders.fresh;
  if (blind && !path.command.joints_blind && !path.command.joint_command.names.empty())
    stop_joints(context, path);
  path.command.joints_blind = blind;
}

/// Commands of a robot without a robot model pass unchanged. All stop when not renewed. After an emergency
/// stop none passes until the joints were released, by a command without motion or by silence.
void handle_joint_command(const TickContext& context, const Message& input, const CommandPath& path) {
  CommandState& state = path.command;
  Joints command;
  if (const Status read = decode(input.channel, input.payload, command); !read) {
    refuse(context, read.error());
    return stop_joints(context, path);  // an unreadable command is a stop
  }
  if (!moves_nothing(command) && refuse_old_motion(context, input, command.stamp, state.joint_command_clock))
    return;
  if (!radio_reaches_robot(context.configuration, path.simulation)) return;
  const bool silent = (context.now - simulation_time(state.joint_command_arrival)).seconds() >=
                      context.configuration.scenario.contact.silence;
  const bool released = silent || moves_nothing(command);
  state.joints_stopped = state.emergency_stop || (state.joints_stopped && !released);
  state.joint_command = std::move(command);
  state.joint_command_arrival = input.arrival;
  send_joint_command(
      context,
      state.joints_stopped ? joint_stop(context, path) : allowed_joints(context, state.joint_command, path),
      path);
}

void handle_agent_teleop(const TickContext& context, const Message& input, std::string_view agent,
                         simulation::Simulation& simulation) {
  const auto command = read_agent_command<TwistCommand>(context, input, agent, channel::kTeleop);
  if (!command) return refuse(context, command.error());
  simulation.teleop(std::string(agent), command->twist);
}

void handle_agent_joint_command(const TickContext& context, const Message& input, std::string_view agent,
                                simulation::Simulation& simulation) {
  const auto command = read_agent_command<Joints>(context, input, agent, channel::kJointCmd);
  if (!command) return refuse(context, command.error());
  if (const Status done = simulation.joint_command(std::string(agent), *command); !done)
    refuse(context, {input.channel + ": " + done.error().message});
}

}  // namespace parhelion::tick
