// Reports the current robots to driving and video clients, in a thread of its own that nothing else can
// delay.
#pragma once

#include <memory>
#include <thread>

#include "server/station/placed_agents.hpp"
#include "server/station/teleop_service.hpp"
#include "server/station/video/camera_faults.hpp"
#include "server/station/video/video_feed.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::station {

class RobotWatch {
 public:
  /// `teleop`: nullptr if nothing can be driven. Both outlive this object. `trainee_why_not`: reason why the
  /// trainee's robot cannot be driven; empty: it can.
  RobotWatch(std::unique_ptr<Bus> bus, std::shared_ptr<const tick::Configuration> configuration,
             VideoFeed& video, TeleopService* teleop, std::string trainee_why_not = {});

  /// Error: a channel cannot be subscribed to.
  Status start();

 private:
  void run(const std::stop_token& stop);
  void take(const Message& message);
  void handle_world(const Message& message);

  std::unique_ptr<Bus> bus_;
  std::shared_ptr<const tick::Configuration> configuration_;
  VideoFeed& video_;
  TeleopService* teleop_;
  const std::string trainee_why_not_;
  WallTime world_due_;              ///< robots appear and disappear rarely: not every world is decoded
  std::vector<std::string> names_;  ///< last reported names
  CameraFaults faults_;
  PlacedAgents placed_;
  std::jthread thread_;
};

/// Describes a robot to pages that may drive it: limits and joints of its model, if known, and whether its
/// camera publishes pictures. `placed`: definition of an agent; nullptr: unknown, or the trainee's robot.
TeleopRobot drivable(const DrivenRobot& robot, const tick::Configuration& configuration,
                     const AgentDefinition* placed);

}  // namespace parhelion::station
