// `parhelion robot new`: a robot description from a URDF, a log and answers.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "tools/robot/dialogue.hpp"
#include "tools/robot/log_survey.hpp"
#include "tools/robot/urdf_outline.hpp"

namespace parhelion::tools {

/// What a person gives beforehand in place of answers.
struct GivenParts {
  /// Of the laser on SCAN: a link, or its position "x,y,z" or "x,y,z,yaw" in base_link (m and degrees); of a
  /// further one "NAME=" and the same.
  std::vector<std::string> lasers;
  /// "length,width" about base_link, or corners "x,y x,y x,y": m, base_link. Empty: of the URDF.
  std::string footprint;
};

struct NewDescription {
  std::string text;  ///< YAML. Behind each value is its source: [urdf], [log], [answer] or [guess]
  std::vector<std::string> notes;  ///< what a person has to look at, one sentence each
};

/// A description from what is known; the rest is asked. Error: the log has scans and no laser is known, the
/// outline is unknown, or an answer that is wrong where nobody can be asked again.
Result<NewDescription> new_description(const UrdfOutline& urdf, const std::optional<LogSurvey>& log,
                                       const Dialogue& dialogue, const GivenParts& given = {});

}  // namespace parhelion::tools
