// An instructor's commands to the server, one type and one channel per meaning. Each is answered by an event,
// command_accepted or command_refused, that carries its request.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "protocols/agent.hpp"
#include "protocols/channels.hpp"
#include "protocols/fault.hpp"
#include "protocols/time.hpp"

namespace parhelion {

// In all: `stamp` is when the command was sent, on the sender's clock; `request` is chosen by the sender.

/// Adds an agent.
struct AgentSpawn {
  SensorTime stamp = {};
  std::uint64_t request = 0;
  AgentDefinition agent = {};
};

/// Moves an agent to another place at once.
struct AgentMove {
  SensorTime stamp = {};
  std::uint64_t request = 0;
  std::string agent = {};
  Transform<Map, Base> T_map_base = {};  ///< planar: on the floor
};

/// Changes the behaviour of an agent.
struct AgentBehaviour {
  SensorTime stamp = {};
  std::uint64_t request = 0;
  std::string agent = {};
  Behaviour behaviour = {};
};

struct AgentRemove {
  SensorTime stamp = {};
  std::uint64_t request = 0;
  bool all = false;        ///< all agents
  std::string agent = {};  ///< empty where it is all
};

/// Freezes or unfreezes an agent. All includes the trainee's robot where it is simulated.
struct AgentFreeze {
  SensorTime stamp = {};
  std::uint64_t request = 0;
  bool all = false;        ///< all agents
  std::string agent = {};  ///< empty where it is all
  bool frozen = true;
};

struct DoorCommand {
  SensorTime stamp = {};
  std::uint64_t request = 0;
  std::string door = {};  ///< its name in the model
  std::optional<double> opening =
      {};  ///< rad, from its closed position; none: released, the sensors determine it
};

struct FaultCommand {
  SensorTime stamp = {};
  std::uint64_t request = 0;
  Fault::Kind kind = Fault::Kind::camera_delay;
  bool begins = true;                   ///< false: ends the faults of this kind that were started by commands
  double amount = 0;                    ///< by kind, as Fault::amount
  bool right = false;                   ///< side of dead_wheel
  std::optional<double> duration = {};  ///< s, above 0; none: until it is ended
};

/// Picture rate of an agent's camera.
struct CameraRate {
  SensorTime stamp = {};
  std::uint64_t request = 0;
  std::string agent = {};
  double rate = 0;  ///< Hz; 0: none
};

/// The trainee reports an object as found.
struct ObjectReport {
  SensorTime stamp = {};
  std::uint64_t request = 0;
  std::string object = {};
  std::optional<Eigen::Vector2d> position = {};  ///< m, map frame; none: it was not reported
};

/// Starts a script of the scenario, whatever its trigger.
struct ScriptStart {
  SensorTime stamp = {};
  std::uint64_t request = 0;
  std::string script = {};
};

/// Stops a robot, whoever drives it, until the stop is released and the dead-man switch was released.
struct EmergencyStopCommand {
  SensorTime stamp = {};
  std::uint64_t request = 0;
  std::string robot = {};  ///< the trainee's, or an agent; empty: every robot of a trainee
  bool engaged = true;     ///< false: released
};

/// Starts the clock of a training that waits for it (Training::on_command).
struct TrainingStart {
  SensorTime stamp = {};
  std::uint64_t request = 0;
};

/// Commands that scripts can give as well.
using AgentCommand = std::variant<AgentSpawn, AgentMove, AgentBehaviour, AgentRemove, AgentFreeze>;

using InstructorCommand =
    std::variant<AgentSpawn, AgentMove, AgentBehaviour, AgentRemove, AgentFreeze, DoorCommand, FaultCommand,
                 CameraRate, ObjectReport, ScriptStart, EmergencyStopCommand, TrainingStart>;

/// Canonical names of their channels, in the order of InstructorCommand.
inline constexpr std::array<const char*, std::variant_size_v<InstructorCommand>> kInstructorChannels{
    channel::kMrSpawn,        channel::kMrMove,   channel::kMrBehaviour,     channel::kMrRemove,
    channel::kMrFreeze,       channel::kMrDoor,   channel::kMrFault,         channel::kMrCameraRate,
    channel::kMrObjectReport, channel::kMrScript, channel::kMrEmergencyStop, channel::kMrStart};

inline const char* channel_of(const InstructorCommand& command) {
  return kInstructorChannels[command.index()];
}
/// An empty command of the type that this canonical channel carries; nullopt: the channel carries no
/// instructor command.
std::optional<InstructorCommand> command_on(std::string_view canonical_channel);

std::uint64_t request_of(const InstructorCommand& command);
void set_request(InstructorCommand& command, SensorTime stamp, std::uint64_t request);
/// Name of the agent, door, object, script, robot or kind of fault that it is about; empty: all.
std::string subject_of(const InstructorCommand& command);
/// m, map frame: the position in the command; zero where it has none.
Eigen::Vector3d position_of(const InstructorCommand& command);
/// Its action, as named in scripts and on the page: "spawn", "unfreeze", "remove_all", "door_unknown".
const char* action_of(const InstructorCommand& command);
const char* action_of(const AgentCommand& command);

/// The same command among all of an instructor's.
InstructorCommand to_instructor_command(const AgentCommand& command);

}  // namespace parhelion
