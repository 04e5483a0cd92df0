// The trainee's commands: TELEOP becomes MR_CMD, and JOINT_CMD becomes MR_JOINT_CMD. Commands are only ever
// reduced (promise 3).
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "protocols/bus/bus.hpp"
#include "protocols/joints.hpp"
#include "protocols/twist_command.hpp"
#include "server/simulation/simulation.hpp"
#include "server/simulation/virtual_contact.hpp"
#include "server/tick/command_clock.hpp"
#include "server/tick/driver_watch.hpp"
#include "server/tick/encoders.hpp"
#include "server/tick/pose_path.hpp"
#include "server/tick/scan_silence.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// State of the trainee's dead-man switch, derived from TELEOP whether or not a robot receives it.
struct DeadMan {
  bool pressed = false;
  ArrivalTime received;              ///< of the newest TELEOP
  std::optional<ArrivalTime> moved;  ///< of the newest TELEOP with motion...
  double speed = 0;                  ///< ...of the footprint's fastest point, m/s
};

struct CommandState {
  /// `start`: of the session. A real robot is held until its dead-man was released, as whoever drove it
  /// before a crash may still hold it.
  void begin(ArrivalTime start, bool real);

  std::optional<TwistCommand> teleop;  ///< the newest
  ArrivalTime teleop_arrival;
  std::optional<SimulationTime> watched_since;  ///< the first step: before it nobody was listened to
  CommandClock teleop_clock;
  SimulationTime last_command;  ///< when MR_CMD was last sent
  simulation::VirtualContactState contact;
  bool own_stop = false;  ///< `teleop` is the server's
  DriverWatch drivers;
  std::optional<simulation::SpeedLimitReason> stop;  ///< as at the newest step
  simulation::SpeedLimitReason speed_limit_reason = simulation::SpeedLimitReason::none;
  DeadMan dead_man;
  bool emergency_stop = false;

  Joints joint_command;  ///< the newest; empty at the start, when no joint has been commanded
  ArrivalTime joint_command_arrival;
  CommandClock joint_command_clock;
  SimulationTime last_joint_command;  ///< when MR_JOINT_CMD was last sent
  bool joints_stopped = false;        ///< after an emergency stop, until the joint commands were released
  bool joints_blind = false;          ///< the encoders of a robot with a robot model are not believed
  /// Joints whose commands are reduced, and why; "" for all of them.
  std::map<std::string, std::string> limited_joints;
};

/// Dependencies of the command path.
struct CommandPath {
  CommandState& command;
  const PoseState& pose;
  const EncoderState& encoders;
  const ScanSilence& scans;
  simulation::Simulation& simulation;
};

/// An unreadable command is a stop. A motion of a real robot is refused if the command is not new (see
/// CommandClock); stamps of 0 are not checked.
void handle_teleop(const TickContext& context, const Message& input, const CommandPath& path);
void handle_joint_command(const TickContext& context, const Message& input, const CommandPath& path);
/// The loop withheld a command that had waited for `age`: after a pause of the process, the trainee no longer
/// means it.
void refuse_stale_command(const TickContext& context, Duration age);
/// At each step: MR_CMD and MR_JOINT_CMD stop when TELEOP has been silent for too long; the dead-man then
/// counts as released. MR_CMD stops, too, when the robot's scans have, and when two consoles drive it.
void watch_silence(const TickContext& context, const CommandPath& path);
/// Stops the robot until the next command.
void stop_robot(const TickContext& context, const CommandPath& path);
/// Stops the robot, or releases the stop. Joint commands are stopped as well, until they were
/// released.
void set_emergency_stop(const TickContext& context, bool stopped, const CommandPath& path);

/// MR_AGENT_<agent>_TELEOP.
void handle_agent_teleop(const TickContext& context, const Message& input, std::string_view agent,
                         simulation::Simulation& simulation);
/// MR_AGENT_<agent>_JOINT_CMD, of an agent that has a robot model.
void handle_agent_joint_command(const TickContext& context, const Message& input, std::string_view agent,
                                simulation::Simulation& simulation);

}  // namespace parhelion::tick
