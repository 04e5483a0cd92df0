// Exports the semantic net as a graph: entities are nodes, relations are edges.
#pragma once

#include <string>

#include "fusion/semantic/net/semantic_net.hpp"
#include "protocols/status.hpp"

namespace parhelion::semantic {

/// Graphviz DOT text. A node is an entity with its label, confidence and position in the plan (`pos`, m); an
/// edge is a relation with its kind and confidence, with an arrow where the kind has a direction.
std::string net_to_dot(const SemanticNet& net);

/// Writes net.dot and net.png (the net drawn over its plan) into a folder, which is created if needed.
/// Errors: a folder that cannot be written; a net without entities.
Status write_net(const SemanticNet& net, const std::string& folder);

}  // namespace parhelion::semantic
