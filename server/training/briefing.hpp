// The trainee's briefing before the start, generated from the scenario.
#pragma once

#include <string>
#include <vector>

#include "protocols/scenario.hpp"

namespace parhelion::training {

/// As what is to be done: "pass through door 1, within 20 s, without touching door 1".
std::string condition_text(const Condition& condition);

/// As what something is given or deducted for: "passing through door 1, within 20 s, without touching door
/// 1".
std::string cause_text(const Condition& condition);

/// The task, the robot, the time, each task with its points, the scale, each penalty, and the values drawn
/// from ranges. Faults are not mentioned: the trainee is to notice them. `robots`: names of those that are
/// graded, at least one. Empty if the scenario has no training.
std::string briefing(const Scenario& scenario, const std::vector<std::string>& robots);

}  // namespace parhelion::training
