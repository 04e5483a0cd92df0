// JSON Schemas of the messages that are sent: Foxglove's published ones and a few of our own (parhelion.*).
#pragma once

#include <string>
#include <string_view>

namespace parhelion::station::foxglove {

/// JSON Schema of a message, such as "foxglove.LaserScan"; empty where it is not one of the messages sent.
std::string schema_text(std::string_view name);

}  // namespace parhelion::station::foxglove
