#include "tools/consoles/operator_view.hpp"

#include <utility>

#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion::tools {
namespace {

/// For a terminal, which would obey control characters of whoever sent a text.
std::string line(const Event& event) {
  constexpr std::size_t longest = 500;
  std::string text = to_string(event.kind);
  for (const std::string& part : {event.subject, event.object}) {
    if (!part.empty()) text += " " + yaml::printable(part);
  }
  return event.text.empty() ? text : text + ": " + yaml::printable(event.text, longest);
}

}  // namespace

Status OperatorView::listen() {
  const std::string command = channel::kMrCmd, joints = channel::kJointState, robots = "\\..+";
  for (const auto& [name, capacity] : {std::pair<std::string, int>{channel::kMrWorld, 1},
                                       {command, 1},
                                       {command + robots, 16},
                                       {joints, 1},
                                       {joints + robots, 16},
                                       {channel::kMrEvents, 64}}) {
    if (Status subscribed = bus_.subscribe(name, capacity); !subscribed) return subscribed;
  }
  return {};
}

Status OperatorView::update() {
  Message message;
  constexpr int max_events = 256;  // messages per call, so that keys are read in between
  for (int i = 0; i < max_events; ++i) {
    const auto received = bus_.receive(message, Duration{0});
    if (!received) return received.error();
    if (!*received) break;
    take(message);
  }
  return {};
}

void OperatorView::take(const Message& message) {
  const auto parts = parse_robot_channel(message.channel);
  if (!parts) return;
  if (message.channel == channel::kMrWorld) {
    WorldMessage world;
    if (decode(message.channel, message.payload, world)) robots_ = station::robots_in(world);
  } else if (parts->canonical == channel::kMrCmd) {
    TwistCommand command;
    if (decode(message.channel, message.payload, command))
      commands_[std::string(parts->robot)] = command.twist;
  } else if (parts->canonical == channel::kJointState) {
    Joints joints;
    if (decode(message.channel, message.payload, joints))
      joints_[std::string(parts->robot)] = std::move(joints.names);
  } else if (message.channel == channel::kMrEvents) {
    Event event;
    // Reports that a contact begins and ends, not that it continues.
    if (decode(message.channel, message.payload, event) && event.kind != EventKind::contact_continues)
      news_.push_back(line(event));
  }
}

std::vector<std::string> OperatorView::take_news() { return std::exchange(news_, {}); }

}  // namespace parhelion::tools
