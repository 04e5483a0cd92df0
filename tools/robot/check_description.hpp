// `parhelion robot check`: what a log contradicts in a robot description.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocols/robot.hpp"
#include "tools/robot/log_survey.hpp"

namespace parhelion::tools {

struct DescriptionCheck {
  std::vector<std::string> contradictions;  ///< each: key, what the log shows, what to do
  std::vector<std::string> agreements;      ///< what was compared and agrees
};

/// No scan arrives before its last beam is measured. Judged by the clock of the log, and by the one that
/// odometry shows, as the clocks of laser and log may differ, or those of laser and odometry: odometry takes
/// less than half a sweep to arrive, or less than 20 ms. nullopt: the description agrees, or the log does not
/// show it.
std::optional<std::string> wrong_stamp_beam(const LaserDescription& laser, const LaserSurvey& seen);

DescriptionCheck check_description(const RobotDescription& robot, const LogSurvey& log);

}  // namespace parhelion::tools
