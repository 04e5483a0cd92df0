// JSON Schemas of the sent messages: Foxglove's well-known schemas, as far as this program fills them, and a
// few of our own (parhelion.*).
#pragma once

#include <string>
#include <string_view>

namespace parhelion::station::foxglove {

/// JSON Schema for a name such as "foxglove.LaserScan"; empty: unknown name.
std::string schema_text(std::string_view name);

}  // namespace parhelion::station::foxglove
