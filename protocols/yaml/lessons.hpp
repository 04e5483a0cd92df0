// Faults of a scenario, and the values that were drawn for it.
#pragma once

#include <vector>

#include "protocols/lesson.hpp"
#include "protocols/yaml/document.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion::yaml {

/// `level`: of the scenario; at level 3 a fault that needs a simulated robot is a problem.
std::vector<Lesson> read_lessons(const Node& list, int level, Problems& problems);
void write_lessons(Writer& writer, const std::vector<Lesson>& lessons);
std::vector<DrawnValue> read_drawn(const Node& list);
void write_drawn(Writer& writer, const std::vector<DrawnValue>& drawn);

}  // namespace parhelion::yaml
