#include "server/station/robot_feed.hpp"

#include <utility>

namespace parhelion::station {
namespace {

std::string graded_instead_of(const tick::Configuration& configuration, const std::string& robot) {
  const auto& training = configuration.scenario.training;
  return training && !training->robot.empty() ? training->robot : robot;
}

}  // namespace

RobotFeed::RobotFeed(const tick::Configuration& configuration, std::size_t robot)
    : name(configuration.robot_at(robot).name),
      graded(graded_instead_of(configuration, name)),
      board(configuration.scenario.training),
      place(configuration, robot) {}

void RobotFeed::restart() {
  sensors.restart();
  board.restart();
  place.restart();
  mixed_scan.reset();
  joints.reset();
  hazard.reset();
  pose_known = false;
}

void RobotFeed::take(PoseEstimate estimate) {
  pose_changed = pose_changed || !pose_known || estimate.state != pose.state;
  pose_known = true;
  pose = estimate;
  place.take(std::move(estimate));
}

bool RobotFeed::take(const Event& event) { return event.subject == graded && board.take(event); }

}  // namespace parhelion::station
