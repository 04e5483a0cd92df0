// The trainee's commands: TELEOP becomes MR_CMD, and JOINT_CMD becomes MR_JOINT_CMD; only ever reduced
// (promise 3).
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "protocols/bus/bus.hpp"
#include "protocols/joints.hpp"
#include "server/simulation/simulation.hpp"
#include "server/simulation/virtual_contact.hpp"
#include "server/tick/pose_path.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// The trainee's dead-man switch as TELEOP shows it, whether a robot receives that or not.
struct DeadMan {
  bool pressed = false;
  ArrivalTime received;              ///< the newest TELEOP
  std::optional<ArrivalTime> moved;  ///< the newest that asked for motion...
  double speed = 0;                  ///< ...of the footprint's fastest point, m/s
};

struct CommandState {
  std::optional<TwistCommand> teleop;  ///< the newest
  ArrivalTime teleop_arrival;
  SimulationTime last_command;  ///< when MR_CMD was last sent
  simulation::VirtualContactState contact;
  simulation::HoldReason speed_limit_reason = simulation::HoldReason::none;
  DeadMan dead_man;
  bool emergency_stop = false;

  Joints joint_command;  ///< the newest; empty at the start: nobody moves joints
  ArrivalTime joint_command_arrival;
  SimulationTime last_joint_command;  ///< when MR_JOINT_CMD was last sent
  bool joints_stopped = false;        ///< until whoever moves them has released them after an emergency stop
};

/// What the command path works on.
struct CommandPath {
  CommandState& command;
  const PoseState& pose;
  simulation::Simulation& simulation;
};

/// A command that cannot be read is a stop.
void handle_teleop(const TickContext& context, const Message& input, const CommandPath& path);
void handle_joint_command(const TickContext& context, const Message& input, const CommandPath& path);
/// At each step: MR_CMD stops when TELEOP has been silent for too long, and so does MR_JOINT_CMD; that
/// silence is a released dead-man.
void watch_silence(const TickContext& context, const CommandPath& path);
/// Nothing moves that robot any more until it is driven again.
void stop_robot(const TickContext& context, const std::string& robot, const CommandPath& path);
/// Stops the trainee's robot, or takes the stop back. What moves joints is stopped as well, until whoever
/// moves them has released them.
void set_emergency_stop(const TickContext& context, bool stopped, const CommandPath& path);

/// MR_AGENT_<agent>_TELEOP.
void handle_agent_teleop(const TickContext& context, const Message& input, std::string_view agent,
                         simulation::Simulation& simulation);

}  // namespace parhelion::tick
