// Scripts of a session: commands for agents, triggered by time or by events.
#pragma once

#include <string>
#include <vector>

#include "protocols/event.hpp"
#include "protocols/instructor_command.hpp"

namespace parhelion {

/// In triggers: the trainee's robot, whatever its name.
inline constexpr const char* kTrainee = "trainee";

struct ScriptTrigger {
  enum class Kind : std::uint8_t {
    time,   ///< `time` after the session began
    event,  ///< one of kind `event`; with `subject` and `object` where these are not empty
    near,   ///< `subject` comes within `distance` of `object`, both agents or the trainee
  };
  Kind kind = Kind::time;
  double time = 0;  ///< s
  EventKind event = EventKind::agent_spawned;
  std::string subject, object;
  double distance = 0;  ///< m, between the origins
};

struct Script {
  std::string name;
  ScriptTrigger when;
  double after = 0;     ///< s, from the trigger to the actions
  bool repeat = false;  ///< each time; with a time trigger: periodically
  std::vector<AgentCommand> actions;
};

}  // namespace parhelion
