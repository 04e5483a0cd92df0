#include "server/station/console/joystick_mapping.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "protocols/share.hpp"
#include "protocols/yaml/parts.hpp"
#include "protocols/yaml/schema.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion::station {
namespace {

using yaml::Node;

constexpr const char* kShipped = "server/station/console/mappings";

MappedAxis read_axis(const Node& node) {
  MappedAxis axis;
  yaml::read(node, "axis", axis.axis);
  yaml::read(node, "invert", axis.invert);
  return axis;
}

MappedJoint read_joint(const Node& node, yaml::Problems& problems) {
  MappedJoint joint;
  yaml::read(node, "joint", joint.joint);
  yaml::read(node, "speed", joint.speed);
  joint.axis = read_axis(node);
  yaml::read(node, "up", joint.up);
  yaml::read(node, "down", joint.down);
  if (joint.axis.axis.empty() && joint.up.empty() && joint.down.empty())
    problems.add(node.line, "'joints': '" + joint.joint + "' needs an axis, or buttons up and down");
  return joint;
}

double value(const std::map<std::string, double>& axes, const MappedAxis& axis) {
  const auto found = axes.find(axis.axis);
  if (found == axes.end()) return 0;
  return axis.invert ? -found->second : found->second;
}

bool down(const JoystickState& state, const std::string& button) {
  const auto found = state.buttons.find(button);
  return found != state.buttons.end() && found->second;
}

template <class Map>
std::string names_of(const Map& map) {
  std::string names;
  for (const auto& [name, value] : map) names += (names.empty() ? "" : ", ") + name;
  return names.empty() ? "none" : names;
}

}  // namespace

Result<JoystickMapping> parse_joystick_mapping(const std::string& text, const std::string& origin) {
  const auto document = yaml::read_checked(text, origin, "joystick");
  if (!document) return document.error();
  yaml::Problems problems(origin);
  JoystickMapping mapping;
  yaml::read(*document, "device", mapping.device);
  yaml::read(*document, "dead_man", mapping.dead_man);
  yaml::read(*document, "dead_zone", mapping.dead_zone);
  yaml::read(*document, "curve", mapping.curve);
  yaml::read(*document, "rate", mapping.rate);
  yaml::read(*document, "speed", mapping.speed);
  yaml::read(*document, "yaw_rate", mapping.yaw_rate);
  yaml::read(*document, "slow", mapping.slow);
  yaml::read(*document, "next_robot", mapping.next_robot);
  const Node& axes = *document->find("axes");
  if (const Node* axis = axes.find("forward")) mapping.forward = read_axis(*axis);
  if (const Node* axis = axes.find("left")) mapping.left = read_axis(*axis);
  if (const Node* axis = axes.find("turn")) mapping.turn = read_axis(*axis);
  if (const Node* joints = document->find("joints")) {
    for (const Node& joint : joints->items) mapping.joints.push_back(read_joint(joint, problems));
  }
  if (!problems.empty()) return problems.error();
  return mapping;
}

std::vector<std::string> shipped_joystick_mappings() { return shipped_names(kShipped); }

Result<JoystickMapping> load_joystick_mapping(const std::string& name_or_path) {
  const std::optional<std::string> path = path_of_shipped(kShipped, name_or_path);
  if (!path) {
    std::string list;
    for (const std::string& each : shipped_joystick_mappings()) list += (list.empty() ? "" : ", ") + each;
    return Error{"no joystick mapping is called '" + yaml::printable(name_or_path) +
                 "'; known: " + (list.empty() ? "none found in " + share_path(kShipped).string() : list) +
                 "; or give the path of a .yaml file"};
  }
  const auto text = yaml::read_text(*path);
  if (!text) return text.error();
  return parse_joystick_mapping(*text, *path);
}

JoystickMapping default_joystick_mapping() {
  JoystickMapping mapping;
  mapping.dead_man = "leftshoulder";
  mapping.forward = {"lefty", true};
  mapping.turn = {"leftx", true};
  mapping.slow = "rightshoulder";
  mapping.next_robot = "start";
  return mapping;
}

Status check_mapping(const JoystickMapping& mapping, const JoystickState& device) {
  std::vector<std::string> axes{mapping.forward.axis, mapping.left.axis, mapping.turn.axis};
  std::vector<std::string> buttons{mapping.dead_man, mapping.slow, mapping.next_robot};
  for (const MappedJoint& joint : mapping.joints) {
    axes.push_back(joint.axis.axis);
    buttons.push_back(joint.up);
    buttons.push_back(joint.down);
  }
  for (const std::string& axis : axes) {
    if (!axis.empty() && !device.axes.contains(axis))
      return Error{"the device has no axis '" + axis + "'; it has " + names_of(device.axes)};
  }
  for (const std::string& button : buttons) {
    if (!button.empty() && !device.buttons.contains(button))
      return Error{"the device has no button '" + button + "'; it has " + names_of(device.buttons)};
  }
  return {};
}

double shaped(double x, double dead_zone, double curve) {
  const double size = std::min(std::abs(x), 1.0);
  if (!(size > dead_zone)) return 0;
  return std::copysign(std::pow((size - dead_zone) / (1 - dead_zone), curve), x);
}

JoystickCommand JoystickDrive::command(const JoystickState& state) {
  JoystickCommand command;
  command.joints.assign(mapping_.joints.size(), 0.0);
  const bool next = down(state, mapping_.next_robot);
  command.next_robot = next && !next_was_down_;
  next_was_down_ = next;
  if (!down(state, mapping_.dead_man)) {
    seen_released_ = true;
    return command;
  }
  if (!seen_released_) return command;
  command.armed = true;
  const double scale = down(state, mapping_.slow) ? 1.0 / 3 : 1.0;
  const auto stick = [&](const MappedAxis& axis) {
    return scale * shaped(value(state.axes, axis), mapping_.dead_zone, mapping_.curve);
  };
  command.twist = {mapping_.speed * stick(mapping_.forward), mapping_.speed * stick(mapping_.left),
                   mapping_.yaw_rate * stick(mapping_.turn)};
  for (std::size_t i = 0; i < mapping_.joints.size(); ++i) {
    const MappedJoint& joint = mapping_.joints[i];
    const double pressed = scale * ((down(state, joint.up) ? 1 : 0) - (down(state, joint.down) ? 1 : 0));
    command.joints[i] = joint.speed * std::clamp(stick(joint.axis) + pressed, -1.0, 1.0);
  }
  return command;
}

}  // namespace parhelion::station
