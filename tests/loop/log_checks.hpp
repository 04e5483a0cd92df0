// What a session log must show of the promises, whoever has driven.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/robot.hpp"

namespace parhelion::test {

struct LogFindings {
  std::vector<std::string> violations;  ///< of promises 1, 2 and 3, the first few of each kind
  int scans = 0, scans_shown = 0;       ///< with a virtual thing in them
  int beams_replaced = 0;
  int commands = 0, commands_reduced = 0;
  int contacts = 0, unsensed_contacts = 0;  ///< of the robot with virtual things: shown, and not shown
  std::map<std::string, double> joints;     ///< rad or m, by the robot's last encoder values
  int joint_commands = 0;                   ///< that moved something
  std::string limited_by;      ///< why MR_CMD was less than the last motion of TELEOP; empty: it was not
  double nearest_shown = 1e9;  ///< m, from the footprint to a virtual return
  std::map<std::string, int> reasons;  ///< of scans that went out unchanged
};

/// Reads the log of a level 3 session. Of promise 1 the log does not hold where the modelled wall was behind
/// an empty beam; the tests of the injection do.
LogFindings check_log(const std::string& path, const RobotDescription& robot, double teleop_silence);

/// Promise 4: the outputs of two session logs, channel by channel. Empty: the same bytes.
std::string output_difference(const std::string& log, const std::string& replayed);

}  // namespace parhelion::test
