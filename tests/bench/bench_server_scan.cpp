// Scan in to scan out inside the server: 361 beams, 80 m, 100 boxes and 50 robots that drive, in a hall of 60
// m. Prints percentiles of the scan path and of the wait for physics, as `replay` measures them.
#include <cstdio>
#include <numbers>
#include <random>

#include "server/report.hpp"
#include "server/tick.hpp"

namespace {

using namespace parhelion;

Configuration hall() {
  Scenario scenario;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> jitter(-0.4, 0.4);
  int boxes = 0, robots = 0;
  for (int row = 0; row < 13; ++row) {
    for (int column = 0; column < 13; ++column) {
      if (std::abs(row - 6) < 1 && std::abs(column - 6) < 1) continue;
      AgentDefinition agent;
      const bool robot = robots < 50 && (row + column) % 3 == 0;
      if (!robot && boxes >= 100) continue;
      agent.kind = robot ? AgentKind::robot : AgentKind::box;
      agent.name = (robot ? "robot_" : "box_") + std::to_string(robot ? robots++ : boxes++);
      agent.T_map_base = Transform<Map, Base>::planar((column - 6) * 4 + jitter(random),
                                                      (row - 6) * 4 + jitter(random), jitter(random));
      agent.behaviour.kind = robot ? BehaviourKind::wander : BehaviourKind::stay;
      scenario.agents.push_back(agent);
    }
  }
  std::fprintf(stderr, "%d boxes, %d robots\n", boxes, robots);
  SemanticModel model;
  model.map_id = "hall";
  for (int side = 0; side < 4; ++side) {
    ModelEntity wall;
    wall.name = "wall " + std::to_string(side);
    wall.label = EntityLabel::wall;
    const double yaw = side * std::numbers::pi / 2;
    wall.T_map_body = Transform<Map, Body>::planar(30 * std::cos(yaw), 30 * std::sin(yaw),
                                                   yaw + std::numbers::pi / 2, 1.25);
    wall.size = {59.8, 0.1, 2.5};
    model.entities.push_back(wall);
  }
  RobotDescription robot;
  robot.laser = *load_laser_preset("lms-200");
  robot.laser->T_base_laser = Transform<Base, Laser>::planar(0.2, 0, 0, 0.3);
  robot.footprint = {{-0.3, -0.25}, {0.3, -0.25}, {0.3, 0.25}, {-0.3, 0.25}};
  return *configure(scenario, robot, model);
}

Message message(const char* channel, std::int64_t utime, const auto& item) {
  Message made{channel, ArrivalTime::from_utime(utime), {}};
  encode(item, made.payload);
  return made;
}

}  // namespace

int main() {
  const Configuration configuration = hall();
  constexpr std::int64_t start = 1'700'000'000'000'000;
  auto made = make_state(configuration, ArrivalTime::from_utime(start - 1000));
  if (!made) return std::fprintf(stderr, "%s\n", made.error().message.c_str()), 1;
  State& state = **made;
  Outputs outputs;
  StageClock stages;
  std::size_t bodies = 0, shapes = 0;
  for (const auto& body : state.simulation.scene()->bodies) {
    if (!body->injectable) continue;
    ++bodies;
    shapes += body->shapes.size();
  }
  const int scans = 2000;
  for (int i = 0; i < scans; ++i) {
    const std::int64_t utime = start + i * 26'667;
    const SensorTime stamp = SensorTime::from_utime(utime);
    const double yaw = 0.3 * i * 0.026667;
    Scan scan;
    scan.stamp = stamp;
    scan.angle_first = static_cast<float>(configuration.robot.laser->angle_first);
    scan.angle_step = static_cast<float>(configuration.robot.laser->angle_step);
    scan.ranges.assign(361, configuration.robot.laser->convention.no_return_sentinel());
    PoseEstimate pose;
    pose.stamp = stamp;
    pose.T_map_base = Transform<Map, Base>::planar(0, 0, yaw);
    pose.covariance = PoseCovariance::Identity() * 1e-6;
    pose.state = SlamState::tracking;
    pose.map_id = "hall";
    const Message inputs[] = {
        message("ODOMETRY", utime + 100, Odometry{stamp, Transform<Odom, Base>::planar(0, 0, yaw)}),
        message("ODOMETRY", utime + 26'500,
                Odometry{stamp + milliseconds(26), Transform<Odom, Base>::planar(0, 0, yaw)}),
        message("POSE_COV", utime + 26'550, pose), message("SCAN", utime + 26'600, scan)};
    for (const Message& input : inputs) {
      outputs.clear();
      stages.begin();
      tick(configuration, input, state, outputs, stages);
    }
  }
  const Tally& tally = state.tally;
  std::printf("bodies %zu, shapes %zu, scans %llu, beams replaced %.1f %%\n", bodies, shapes,
              static_cast<unsigned long long>(tally.scans_in),
              100.0 * static_cast<double>(tally.beams_replaced) / static_cast<double>(tally.beams_total));
  const auto line = [](const char* what, const Percentiles& p) {
    std::printf("%-28s p50 %8.0f us  p90 %8.0f us  p99 %8.0f us  max %8.0f us\n", what, p.at(0.5), p.at(0.9),
                p.at(0.99), p.max());
  };
  line("scan in to scan out", stages.scan_us);
  line("wait for physics", stages.physics_wait_us);
  line("one physics step", stages.physics_step_us);
  return tally.scans_in == scans && tally.beams_replaced > 0 ? 0 : 1;
}
