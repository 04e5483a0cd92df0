// The figures of a session for its trainee.
#pragma once

#include <string>

#include "server/runtime/report.hpp"

namespace parhelion::runtime {

/// As to_json(): his points and the figures of his robot, without what decided them and what others did.
std::string to_trainees_json(const Report& report);

}  // namespace parhelion::runtime
