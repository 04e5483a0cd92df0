// The semantic net as a graph, for people: entities are nodes, relations are edges.
#pragma once

#include <string>

#include "fusion/semantic/semantic_net.hpp"
#include "protocols/status.hpp"

namespace parhelion::semantic {

/// Graphviz DOT text. A node is an entity with its label and confidence, where it is in the plan (`pos`, m);
/// an edge is a relation with its kind and confidence, with an arrow where the kind has a direction.
std::string net_to_dot(const SemanticNet& net);

/// Writes net.dot and net.png, the same net drawn over its plan, into a folder that is made where there is
/// none. Errors: a folder that cannot be written; a net without entities.
Status write_net(const SemanticNet& net, const std::string& folder);

}  // namespace parhelion::semantic
