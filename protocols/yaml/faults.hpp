// Faults of a scenario, and the values that were drawn for it.
#pragma once

#include <vector>

#include "protocols/fault.hpp"
#include "protocols/yaml/document.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion::yaml {

/// `level`: of the scenario; at level 3 a fault that needs a simulated robot is a problem.
std::vector<Fault> read_faults(const Node& list, int level, Problems& problems);
void write_faults(Writer& writer, const std::vector<Fault>& faults);
std::vector<DrawnValue> read_drawn(const Node& list);
void write_drawn(Writer& writer, const std::vector<DrawnValue>& drawn);

}  // namespace parhelion::yaml
