// `parhelion robot new`: a robot description from a URDF, a log and answers.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "protocols/status.hpp"
#include "tools/robot/log_survey.hpp"
#include "tools/robot/urdf_outline.hpp"

namespace parhelion::tools {

/// The answer to a question, given what is likely. Without anybody to ask: what is likely.
using Ask = std::function<std::string(const std::string& question, const std::string& likely)>;

/// The text of a description (YAML). Behind each value is its source: [urdf], [log], [answer], or [guess],
/// which is to be measured. Error: neither the URDF nor the log has a laser, an answer that is no link of the
/// URDF or no number.
Result<std::string> new_description(const UrdfOutline& urdf, const std::optional<LogSurvey>& log,
                                    const Ask& ask);

}  // namespace parhelion::tools
