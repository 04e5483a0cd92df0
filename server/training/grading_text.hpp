// Texts about grading for people.
#pragma once

#include <optional>
#include <string>

#include "server/training/grader.hpp"

namespace parhelion::training {

/// "contact_started rover - wall 1 (in the hall), 3.20 N s"; empty without an event.
std::string event_text(const std::optional<Event>& event);
/// "+50 points", "-2.5 points".
std::string points_text(double points);
/// "93 of 100 points (93.0 %), grade A, passed".
std::string verdict_text(const Grade& grade);

}  // namespace parhelion::training
