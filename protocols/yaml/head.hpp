// The joints that carry a sensor, in a robot description.
#pragma once

#include <vector>

#include "protocols/image.hpp"
#include "protocols/yaml/document.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion::yaml {

/// Reads the key `head` of a sensor; empty where it is absent.
std::vector<HeadJoint> read_head(const Node& sensor, Problems& problems);
/// Writes nothing where there are no joints.
void write_head(Writer& writer, const std::vector<HeadJoint>& head);

}  // namespace parhelion::yaml
