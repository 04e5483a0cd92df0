// The figures of a session for its trainee.
#pragma once

#include <string>

#include "server/runtime/report.hpp"

namespace parhelion::runtime {

/// As to_json(), with the trainee's points and the figures of the trainee's robot only: not why they were
/// given, nor what others did.
std::string to_trainees_json(const Report& report);

}  // namespace parhelion::runtime
