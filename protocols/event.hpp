// What happened in the session (channel MR_EVENTS): what the grader reads.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "protocols/time.hpp"

namespace parhelion {

enum class EventKind : std::uint8_t {
  command_accepted,  ///< answer to an AgentCommand: after it was written to the log
  command_refused,   ///< `text` says why and, for a place that is taken, where there is room
  agent_spawned,
  agent_moved,
  agent_removed,
  collision_started,
  collision_stopped,
  pose_lost,
  pose_recovered,
  relocalized,
  command_reduced,  ///< virtual contact held TELEOP back (start of it)
  command_restored,
  injection_degraded,
  injection_restored,
  model_changed,  ///< a new version of the model took the old one's place; `text` says which
};

enum class PairKind : std::uint8_t { none, real_real, real_virtual, virtual_virtual };

struct Event {
  SimulationTime stamp;  ///< when it happened
  EventKind kind = EventKind::agent_spawned;
  std::string subject;  ///< entity that it is about
  std::string object;   ///< the other one, or empty
  PairKind pair = PairKind::none;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, map frame, where it has a place
  double impulse = 0;                                  ///< N s, of a contact
  bool unsensed = false;                               ///< while injection was degraded: never scored
  std::uint64_t request = 0;
  std::string text;
};

const char* to_string(EventKind kind);

}  // namespace parhelion
