// Keeps those who drive and those who watch video informed of which robots there are, in a thread of its own
// that nothing else can hold up.
#pragma once

#include <memory>
#include <thread>

#include "server/station/placed_agents.hpp"
#include "server/station/teleop_desk.hpp"
#include "server/station/video/camera_lessons.hpp"
#include "server/station/video/video_feed.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::station {

class RobotWatch {
 public:
  /// `teleop`: nullptr where nothing can be driven. Both outlive this. `trainee_why_not`: why the trainee's
  /// robot cannot be; empty: it can.
  RobotWatch(std::unique_ptr<Bus> bus, std::shared_ptr<const tick::Configuration> configuration,
             VideoFeed& video, TeleopDesk* teleop, std::string trainee_why_not = {});

  /// Error: a channel cannot be subscribed to.
  Status start();

 private:
  void run(const std::stop_token& stop);
  void take(const Message& message);
  void take_world(const Message& message);

  std::unique_ptr<Bus> bus_;
  std::shared_ptr<const tick::Configuration> configuration_;
  VideoFeed& video_;
  TeleopDesk* teleop_;
  const std::string trainee_why_not_;
  WallTime world_due_;              ///< robots come and go seldom: not every world is read
  std::vector<std::string> names_;  ///< that were told last
  CameraLessons lessons_;
  PlacedAgents placed_;
  std::jthread thread_;
};

/// A robot as pages may drive it: with the limits and joints of its model where that is known, and whether
/// its camera sends pictures. `placed`: how an agent was defined; nullptr: nobody knows, or it is the
/// trainee's.
TeleopRobot drivable(const DrivenRobot& robot, const tick::Configuration& configuration,
                     const AgentDefinition* placed);

}  // namespace parhelion::station
