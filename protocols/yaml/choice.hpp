// One key of several, one name of several: what conditions, triggers and actions are chosen by.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocols/event.hpp"
#include "protocols/yaml/document.hpp"

namespace parhelion::yaml {

/// The one of `keys` that is there; none or several are a problem of `what` ("'when'"), `advice` being what
/// to do about several. Of several the last is returned, of none nullptr.
const Node* only_one(const Node& node, const std::vector<std::string>& keys, const std::string& what,
                     Problems& problems, const std::string& advice = "");

/// The event of this name; another is a problem.
std::optional<EventKind> read_event_kind(const Node& name, Problems& problems);

}  // namespace parhelion::yaml
