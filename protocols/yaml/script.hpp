// The scripts of a scenario. Nodes have passed check().
#pragma once

#include <vector>

#include "protocols/instructor_command.hpp"
#include "protocols/script.hpp"
#include "protocols/yaml/document.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion::yaml {

/// `agents`: of the scenario; a script may name them and those that scripts spawn.
std::vector<Script> read_scripts(const Node& list, const std::vector<AgentDefinition>& agents,
                                 Problems& problems);
void write_scripts(Writer& writer, const std::vector<Script>& scripts);

}  // namespace parhelion::yaml
