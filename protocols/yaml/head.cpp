#include "protocols/yaml/head.hpp"

#include <algorithm>
#include <cmath>

#include "protocols/yaml/parts.hpp"
#include "protocols/yaml/quantity.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion::yaml {

std::vector<HeadJoint> read_head(const Node& sensor, Problems& problems) {
  std::vector<HeadJoint> head;
  const Node* list = sensor.find("head");
  if (list == nullptr) return head;
  for (const Node& item : list->items) {
    HeadJoint& joint = head.emplace_back();
    read(item, "joint", joint.joint);
    if (const Node* point = item.find("point")) joint.point = vector3(*point);
    const Node& axis = *item.find("axis");
    for (int i = 0; i < 3; ++i) joint.axis[i] = axis.items[static_cast<std::size_t>(i)].number;
    const double length = joint.axis.norm();
    if (!(std::abs(length - 1) < 0.01)) {
      problems.add(axis.line, "'axis': expected a direction of length 1 such as [0, 0, 1], found length " +
                                  format_number(length));
    } else if (std::abs(length - 1) > 1e-12) {
      joint.axis /= length;
    }
    const auto same = [&](const HeadJoint& other) { return other.joint == joint.joint; };
    if (std::count_if(head.begin(), head.end(), same) > 1)
      problems.add(item.line, "'joint': '" + printable(joint.joint) + "' is a duplicate");
  }
  return head;
}

void write_head(Writer& writer, const std::vector<HeadJoint>& head) {
  if (head.empty()) return;
  writer.open("head");
  for (const HeadJoint& joint : head) {
    writer.begin_item();
    writer.text("joint", joint.joint);
    writer.line("point", format_lengths(joint.point.data(), 3));
    writer.line("axis", "[" + format_number(joint.axis.x()) + ", " + format_number(joint.axis.y()) + ", " +
                            format_number(joint.axis.z()) + "]");
    writer.end_item();
  }
  writer.close();
}

}  // namespace parhelion::yaml
