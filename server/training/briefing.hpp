// What a trainee is told before the start, made from the scenario.
#pragma once

#include <string>

#include "protocols/scenario.hpp"

namespace parhelion::training {

/// In words: "pass door 1 without collision_started of door 1, within 20 s".
std::string condition_text(const Condition& condition);

/// The task, what it is done with, the time, each task with its points, the scale, each penalty, and what was
/// drawn of ranges. Lessons are not told: what goes wrong is for the trainee to notice. `robot`: the name of
/// the one that is graded. Empty where the scenario has no training.
std::string briefing(const Scenario& scenario, const std::string& robot);

}  // namespace parhelion::training
