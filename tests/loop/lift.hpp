// Lift and place at level 3 with the example robot's arm and gripper, by script, in a server without a
// network.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/event.hpp"
#include "server/training/grader.hpp"

namespace parhelion::test {

enum class LiftBy {
  trainee,  ///< by JOINT_CMD, which the server reduces
  robot,    ///< the robot moves its arm itself, while the trainee drives a virtual robot
};

struct LiftReport {
  std::string thing;                  ///< kind, width, height, mass and place, for people
  std::string phase;                  ///< of the script, at its end
  std::vector<Event> events;          ///< gripped, lifted, placed, dropped, payload_exceeded, joint_overload
  std::vector<std::string> failures;  ///< empty: as it must be
  double worst_delay = 0;             ///< s between what truly happened and its event
  int beams_of_thing = 0;             ///< in MR_SCAN, before it was lifted
  training::Grade live, from_log;
  std::vector<Message> inputs;
  /// Payloads by channel, in order.
  std::map<std::string, std::vector<std::vector<std::uint8_t>>> outputs;
};

/// Thing, container, places, mass and sizes are drawn from `seed`.
LiftReport lift_and_place(std::uint64_t seed, LiftBy by, int threads = 1);

/// The same inputs given to a new server: its outputs.
std::map<std::string, std::vector<std::vector<std::uint8_t>>> lift_again(std::uint64_t seed, LiftBy by,
                                                                         const LiftReport& report,
                                                                         int threads);

}  // namespace parhelion::test
