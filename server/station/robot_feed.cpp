#include "server/station/robot_feed.hpp"

#include <utility>

namespace parhelion::station {
namespace {

std::string graded_among_several(const tick::Configuration& configuration, const std::string& robot) {
  return tick::graded_robots(configuration).size() < 2 ? std::string() : robot;
}

}  // namespace

RobotFeed::RobotFeed(const tick::Configuration& configuration, std::size_t robot)
    : name(configuration.robot_at(robot).name),
      graded(graded_among_several(configuration, name)),
      board(configuration.scenario.training),
      place(configuration, robot) {}

void RobotFeed::restart() {
  sensors.restart();
  board.restart();
  place.restart();
  augmented_scan.reset();
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

bool RobotFeed::take(const Event& event) {
  const bool mine = graded.empty() || event.subject == graded || event.kind == EventKind::training_started;
  return mine && board.take(event);
}

}  // namespace parhelion::station
