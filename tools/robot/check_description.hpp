// `parhelion robot check`: what a log contradicts in a robot description.
#pragma once

#include <string>
#include <vector>

#include "protocols/robot.hpp"
#include "tools/robot/log_survey.hpp"

namespace parhelion::tools {

struct DescriptionCheck {
  std::vector<std::string> contradictions;  ///< each: key, what the log shows, what to do
  std::vector<std::string> agreements;      ///< what was compared and agrees
};

DescriptionCheck check_description(const RobotDescription& robot, const LogSurvey& log);

}  // namespace parhelion::tools
