// The laser part of a robot description, and presets.
#pragma once

#include <string>

#include "protocols/scan.hpp"
#include "protocols/yaml/document.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion::yaml {

/// A robot's laser: the given keys, with the preset's values for missing ones.
LaserDescription read_laser(const Node& map, Problems& problems);
/// A preset file: without pose and without a preset of its own.
LaserDescription read_preset(const Node& map, Problems& problems);
/// Writes the contents of the map `laser` or `line_laser`, without opening it.
void write_laser(Writer& writer, const LaserDescription& laser);

}  // namespace parhelion::yaml
