// Tasks and grading of a scenario. Nodes have passed check() of the scenario; conditions are checked here.
#pragma once

#include "protocols/training.hpp"
#include "protocols/yaml/document.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion::yaml {

Training read_training(Node& node, Problems& problems);
void write_training(Writer& writer, const Training& training);

}  // namespace parhelion::yaml
