// The lasers of a new robot description.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/robot/description_text.hpp"
#include "tools/robot/dialogue.hpp"
#include "tools/robot/log_survey.hpp"
#include "tools/robot/urdf_outline.hpp"

namespace parhelion::tools {

/// What the lasers of a description are taken from.
struct LaserSources {
  const UrdfOutline& urdf;
  const std::optional<LogSurvey>& log;
  const std::vector<std::string>& given;  ///< see GivenParts::lasers
  const Dialogue& dialogue;
};

/// Writes `laser` and `lasers`; false: the robot has no laser. What a person has to look at is added to
/// `notes`. Throws WrongAnswer.
bool write_lasers(const LaserSources& sources, DescriptionText& text, std::vector<std::string>& notes);

}  // namespace parhelion::tools
