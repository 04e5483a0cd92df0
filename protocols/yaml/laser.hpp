// The laser part of a robot description, and presets.
#pragma once

#include <string>

#include "protocols/scan.hpp"
#include "protocols/yaml/document.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion::yaml {

/// A robot's laser: the preset's values (read only where a key is missing) under the keys that are given.
LaserDescription read_laser(const Node& map, Problems& problems);
/// A preset file on its own; no pose, no preset of its own.
LaserDescription read_preset(const Node& map, Problems& problems);
/// What stands in the map `laser` or `line_laser`, without opening it.
void write_laser(Writer& writer, const LaserDescription& laser);

}  // namespace parhelion::yaml
