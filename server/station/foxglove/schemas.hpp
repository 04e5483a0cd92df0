// JSON Schemas of what is sent: Foxglove's well-known ones by their names, as far as this program fills them,
// and a few of our own (parhelion.*).
#pragma once

#include <string>
#include <string_view>

namespace parhelion::station::foxglove {

/// "foxglove.LaserScan" to its JSON Schema; empty: not one of ours.
std::string schema_text(std::string_view name);

}  // namespace parhelion::station::foxglove
