// The robot's end of a bus with authentication.
#pragma once

#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/joints.hpp"

namespace parhelion::tools {

/// What the server sends to a robot: MR_SCAN, MR_CAMERA, MR_DEPTH, MR_CMD, MR_JOINT_CMD.
std::vector<std::string> channels_to_robot();
/// What a robot sends: its sensors, its joints and its description.
std::vector<std::string> channels_from_robot();

/// Passes messages on from `site`, which verifies them, to the robot's own bus. Commands are checked once
/// more: one that waited for longer than driving_timing::kMaxQueueAge is dropped, and after kRelaySilence
/// without a command that moves, the robot gets a stop. Call turn() in one thread.
class RelayToRobot {
 public:
  RelayToRobot(Bus& site, Bus& robot) : site_(site), robot_(robot) {}

  /// Waits for one message at most as long as `timeout`. Error: a bus failed.
  Status turn(Duration timeout);
  /// Stops what still moves; call at the end.
  Status stop();

 private:
  /// The channel on which something moves, and the command that ends it.
  struct Moving {
    std::string channel;
    ArrivalTime last;
    std::vector<std::uint8_t> stop;
  };
  Status pass_on(const Message& message);
  Status send_stop(Moving& moving);

  Bus& site_;
  Bus& robot_;
  Message message_;
  std::vector<Moving> moving_;
};

/// Passes one message of the robot's bus on to `site`, if one arrives within `timeout`.
Status relay_from_robot(Bus& robot, Bus& site, Message& message, Duration timeout);

}  // namespace parhelion::tools
