// Two robots that drive in the synthetic room, each with its own channels.
#pragma once

#include <string>
#include <vector>

#include "protocols/channel_map.hpp"
#include "tests/server/tick/synthetic.hpp"

namespace parhelion::test {

inline const std::string kRover1 = "rover_1", kRover2 = "rover_2";

/// Two robots with the synthetic robot's description.
inline Scenario two_robots(std::vector<AgentDefinition> agents = {}) {
  Scenario scenario;
  scenario.name = "two robots";
  scenario.robots = {{kRover1, "one.yaml"}, {kRover2, "two.yaml"}};
  scenario.agents = std::move(agents);
  return scenario;
}

inline tick::Configuration two_robots_configuration(const Scenario& scenario) {
  auto made = tick::configure_robots(scenario, std::vector<RobotDescription>{robot(), robot()}, room());
  EXPECT_TRUE(made.ok()) << (made ? "" : made.error().message);
  return *made;
}

/// The messages on channels of this robot; those of the circle are moved by `offset` on the map.
inline std::vector<Message> of_robot(std::vector<Message> log, const std::string& name) {
  for (Message& each : log) each.channel = robot_channel(each.channel, name);
  return log;
}

/// A robot that stands at `T_map_base`: ODOMETRY at 20 Hz, SCAN at 10 Hz and POSE_COV; `cast(t)` gives its
/// scans.
template <class Cast>
std::vector<Message> standing(double duration, const Transform<Map, Base>& T_map_base, Cast cast,
                              double sigma = 0.01) {
  std::vector<Message> log;
  for (int i = 0; i * 0.05 < duration; ++i) {
    const std::int64_t utime = kStartUs + i * 50'000;
    log.push_back(message(channel::kOdometry, utime + 2100,
                          Odometry{SensorTime::from_utime(utime), T_map_base.as<Odom, Base>()}));
    if (i % 2 != 0) continue;
    log.push_back(message(channel::kScan, utime + 5100, cast(i * 0.05)));
    PoseEstimate estimate;
    estimate.stamp = SensorTime::from_utime(utime);
    estimate.T_map_base = T_map_base;
    estimate.covariance = PoseCovariance::Identity() * sigma * sigma;
    estimate.covariance(5, 5) = 1e-6;
    estimate.map_id = "synthetic";
    estimate.state = SlamState::tracking;
    log.push_back(message(channel::kPoseCov, utime + 25100, estimate));
  }
  return log;
}

/// The room as a robot at this place sees it, with a box of `size` about `other` in it, if given.
inline Scan seen_from(const Transform<Map, Base>& T_map_base, double t,
                      const Transform<Map, Base>* other = nullptr,
                      const Eigen::Vector3d& size = {0.6, 0.5, 0.5}) {
  SemanticModel model = room();
  if (other != nullptr) {
    ModelEntity box;
    box.name = "the other robot";
    box.label = EntityLabel::wall;
    box.T_map_body = Transform<Map, Body>(other->isometry() * Eigen::Translation3d(0, 0, size.z() / 2));
    box.size = size;
    model.entities.push_back(box);
  }
  return exact_scan(*robot().laser, T_map_base, model,
                    SensorTime::from_utime(kStartUs + static_cast<std::int64_t>(t * 1e6)));
}

inline std::vector<Message> by_arrival(std::vector<Message> one, const std::vector<Message>& other) {
  one.insert(one.end(), other.begin(), other.end());
  std::stable_sort(one.begin(), one.end(),
                   [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
  return one;
}

/// rover_1 drives its circle, rover_2 stands in a corner.
inline std::vector<Message> two_robots_drive(double duration) {
  const auto place = Transform<Map, Base>::planar(4, -3, 2.4);
  return by_arrival(
      of_robot(drive(duration), kRover1),
      of_robot(standing(duration, place, [&](double t) { return seen_from(place, t); }), kRover2));
}

}  // namespace parhelion::test
