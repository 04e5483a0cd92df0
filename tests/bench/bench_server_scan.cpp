// Scan in to scan out inside the server: 361 beams, 80 m, 100 boxes and 50 robots that drive, in a hall of 60
// m. Prints percentiles of the scan path and of the wait for physics, as `replay` measures them.
//   bench_server_scan [SCANS]
//   bench_server_scan grading: ten runs with and ten without grading, in turn
#include <cstdio>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

#include "protocols/quantile.hpp"
#include "server/runtime/report.hpp"
#include "server/tick/grading_path.hpp"
#include "server/tick/tick.hpp"
#include "tests/server/tick/message.hpp"

namespace {

using namespace parhelion;
using test::message;

tick::Configuration hall() {
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
  return *tick::configure(scenario, robot, model);
}

struct Run {
  runtime::StageClock stages;
  tick::Percentiles scan_in_to_out;  ///< includes the wait for physics, in which events and worlds are graded
  tick::Tally tally;
  std::size_t deductions = 0;
};

Run run(const tick::Configuration& configuration, int scans) {
  constexpr std::int64_t start = 1'700'000'000'000'000;
  auto made = tick::make_state(configuration, ArrivalTime::from_utime(start - 1000));
  if (!made) throw std::runtime_error(made.error().message);
  tick::State& state = **made;
  tick::Outputs outputs;
  Run result;
  for (int i = 0; i < scans; ++i) {
    const std::int64_t utime = start + i * 26'667;
    const SensorTime stamp = SensorTime::from_utime(utime);
    const double yaw = 0.3 * i * 0.026667;
    Scan scan;
    scan.stamp = stamp;
    scan.angle_min = static_cast<float>(configuration.robot.laser->angle_min);
    scan.angle_increment = static_cast<float>(configuration.robot.laser->angle_increment);
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
      result.stages.begin();
      const WallTime begun = runtime::steady_now();
      tick::tick(configuration, input, state, outputs, result.stages);
      if (input.channel == "SCAN") result.scan_in_to_out.add((runtime::steady_now() - begun).microseconds());
    }
  }
  result.tally = state.tally;
  if (state.grading) result.deductions = state.grading->graders.front().grade().deductions.size();
  return result;
}

void line(const char* what, const tick::Percentiles& p) {
  std::printf("%-28s p50 %8.0f us  p90 %8.0f us  p99 %8.0f us  max %8.0f us\n", what, p.at(0.5), p.at(0.9),
              p.at(0.99), p.max());
}

/// Twelve rules and tasks about events and places.
Training lesson() {
  Training training;
  training.in_order = false;
  for (int i = 0; i < 6; ++i) {
    Task& task = training.tasks.emplace_back();
    task.name = "never " + std::to_string(i);
    task.points = 10;
    task.done.kind = Condition::Kind::near;
    task.done.target = "robot_" + std::to_string(7 * i);
    task.done.distance = 0.1;
    Penalty& penalty = training.penalties.emplace_back();
    penalty.name = "rule " + std::to_string(i);
    penalty.points = 1;
    if (i % 2 == 0) {
      const EventKind kinds[] = {EventKind::contact_started, EventKind::collision_predicted,
                                 EventKind::near_miss};
      penalty.when.event = kinds[i / 2];
      penalty.when.subject = "any";
    } else {
      penalty.when.kind = Condition::Kind::near;
      penalty.when.target = "robot_" + std::to_string(i);
      penalty.when.distance = 30;  // the whole hall: deducted at once, and still monitored
    }
  }
  return training;
}

/// Ten runs of each, interleaved.
int compare_grading() {
  const tick::Configuration without = hall();
  tick::Configuration with = without;
  with.scenario.training = lesson();
  std::vector<double> p50[2], p99[2];
  for (int i = 0; i < 20; ++i) {
    const bool graded = i % 2 != 0;
    const Run one = run(graded ? with : without, 500);
    p50[graded].push_back(one.scan_in_to_out.at(0.5));
    p99[graded].push_back(one.scan_in_to_out.at(0.99));
    std::printf("%-8s p50 %6.0f us  p99 %6.0f us  %zu deductions\n", graded ? "graded" : "not",
                p50[graded].back(), p99[graded].back(), one.deductions);
  }
  std::printf(
      "median of ten: p50 %.0f us without, %.0f us with grading (%+.1f %%); p99 %.0f us, %.0f us (%+.0f "
      "us)\n",
      median(p50[0]), median(p50[1]), 100 * (median(p50[1]) / median(p50[0]) - 1), median(p99[0]),
      median(p99[1]), median(p99[1]) - median(p99[0]));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string(argv[1]) == "grading") return compare_grading();
  const tick::Configuration configuration = hall();
  const int scans = argc > 1 ? std::stoi(argv[1]) : 2000;
  const Run result = run(configuration, scans);
  const tick::Tally& tally = result.tally;
  std::printf("scans %llu, beams replaced %.1f %%\n", static_cast<unsigned long long>(tally.scans_in),
              100.0 * static_cast<double>(tally.beams_replaced) / static_cast<double>(tally.beams_total));
  line("scan in to scan out", result.stages.scan_us);
  line("wait for physics", result.stages.physics_wait_us);
  line("one physics step", result.stages.physics_step_us);
  return tally.scans_in == static_cast<std::uint64_t>(scans) && tally.beams_replaced > 0 ? 0 : 1;
}
