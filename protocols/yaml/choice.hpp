// Choices in conditions, triggers and actions: exactly one of several keys or names.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocols/event.hpp"
#include "protocols/yaml/document.hpp"

namespace parhelion::yaml {

/// The one key of `keys` that is present; none or several are a problem of `what` ("'when'"), with `advice`
/// on what to do about several. Returns nullptr for none, the last of several, so that the caller reads
/// on and finds further problems in the same run.
const Node* only_one(const Node& node, const std::vector<std::string>& keys, const std::string& what,
                     Problems& problems, const std::string& advice = "");

/// The event of this name; an unknown name is a problem.
std::optional<EventKind> read_event_kind(const Node& name, Problems& problems);

}  // namespace parhelion::yaml
