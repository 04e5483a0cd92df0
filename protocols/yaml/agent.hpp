// An agent in scenarios and their scripts. Nodes have passed check().
#pragma once

#include "protocols/agent.hpp"
#include "protocols/yaml/document.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion::yaml {

AgentDefinition read_agent(const Node& node, Problems& problems);
void read_behaviour(const Node& node, Behaviour& behaviour, Problems& problems);
/// An agent's pose, which must be upright.
void read_agent_pose(const Node& node, Transform<Map, Base>& T_map_base, Problems& problems);

/// The keys of an agent, one level down.
void write_agent(Writer& writer, const AgentDefinition& agent);
void write_behaviour(Writer& writer, const Behaviour& behaviour);

}  // namespace parhelion::yaml
