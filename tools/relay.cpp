#include "tools/relay.hpp"

#include <algorithm>

#include "protocols/authentication/keys.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/driving_timing.hpp"
#include "server/runtime/wall_clock.hpp"

namespace parhelion::tools {
namespace {

ArrivalTime now() { return {runtime::wall_now().ns}; }

/// The command that ends the motion commanded by `message`; empty: it is no command.
std::vector<std::uint8_t> stop_of(const Message& message, bool& moves) {
  std::vector<std::uint8_t> stop;
  const auto is_zero = [](double value) { return value == 0; };
  TwistCommand command;
  Joints joints;
  if (decode(message.channel, message.payload, command)) {
    moves = command.twist.vx != 0 || command.twist.vy != 0 || command.twist.wz != 0;
    encode(TwistCommand{{now().ns}, {}, command.type}, stop);
  } else if (decode(message.channel, message.payload, joints)) {
    moves = !joints.positions.empty() ||
            !std::all_of(joints.velocities.begin(), joints.velocities.end(), is_zero) ||
            !std::all_of(joints.efforts.begin(), joints.efforts.end(), is_zero);
    encode(Joints{{now().ns}, joints.names, {}, std::vector<double>(joints.names.size(), 0), {}}, stop);
  }
  return stop;
}

}  // namespace

std::vector<std::string> channels_to_robot() {
  using namespace channel;
  return {kMrScan, kMrCamera, kMrDepth, kMrCmd, kMrJointCmd};
}

std::vector<std::string> channels_from_robot() { return *channels_of_role("robot"); }

Status RelayToRobot::turn(Duration timeout) {
  const auto came = site_.receive(message_, timeout);
  if (!came) return came.error();
  if (*came) {
    if (Status passed = pass_on(message_); !passed) return passed;
  }
  const ArrivalTime silent_since = now() - driving_timing::kRelaySilence;
  for (Moving& moving : moving_) {
    if (moving.last > silent_since) continue;
    if (Status sent = send_stop(moving); !sent) return sent;
  }
  std::erase_if(moving_, [](const Moving& moving) { return moving.stop.empty(); });
  return {};
}

Status RelayToRobot::stop() {
  for (Moving& moving : moving_) {
    if (Status sent = send_stop(moving); !sent) return sent;
  }
  moving_.clear();
  return {};
}

Status RelayToRobot::pass_on(const Message& message) {
  bool moves = false;
  std::vector<std::uint8_t> stop = stop_of(message, moves);
  if (moves) {
    if (now() - message.arrival > driving_timing::kMaxQueueAge) return {};
    const auto known = std::find_if(moving_.begin(), moving_.end(),
                                    [&](const Moving& moving) { return moving.channel == message.channel; });
    Moving& moving = known == moving_.end() ? moving_.emplace_back() : *known;
    moving = {message.channel, now(), std::move(stop)};
  } else if (!stop.empty()) {
    std::erase_if(moving_, [&](const Moving& moving) { return moving.channel == message.channel; });
  }
  return robot_.publish(message.channel, message.payload);
}

Status RelayToRobot::send_stop(Moving& moving) {
  const std::vector<std::uint8_t> stop = std::exchange(moving.stop, {});
  return robot_.publish(moving.channel, stop);
}

Status relay_from_robot(Bus& robot, Bus& site, Message& message, Duration timeout) {
  const auto came = robot.receive(message, timeout);
  if (!came) return came.error();
  return *came ? site.publish(message.channel, message.payload) : Status{};
}

}  // namespace parhelion::tools
