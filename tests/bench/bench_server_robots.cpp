// Four real robots and 30 agents in one live server, on LCM over loopback: scans of 361 beams at 10 Hz each,
// odometry at 50 Hz, poses at 10 Hz. Prints the scan path of each robot, and what a fault of the fourth does
// to the three others, as the median of the runs: bench_server_robots [SECONDS [RUNS]].
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include "fusion/scan/lidar_model.hpp"
#include "protocols/quantile.hpp"
#include "server/runtime/loop.hpp"
#include "server/runtime/wall_clock.hpp"
#include "tests/server/tick/several_robots.hpp"

namespace {

using namespace parhelion;

constexpr int kRobots = 4;
constexpr const char* kUrl = "udpm://239.255.76.67:7703?ttl=0&recv_buf_size=4194304";

enum class Fault { none, no_pose, no_scan, unreadable_scan, flood };
constexpr std::array<std::pair<Fault, const char*>, 5> kFaults{
    {{Fault::none, "none"},
     {Fault::no_pose, "its pose is lost"},
     {Fault::no_scan, "its laser is silent"},
     {Fault::unreadable_scan, "its scans are unreadable"},
     {Fault::flood, "it sends 1,000 scans a second"}}};

std::string name_of(int robot) { return "rover_" + std::to_string(robot + 1); }

RobotDescription description() {
  RobotDescription robot = test::robot();
  robot.laser->beams = 361;
  robot.laser->angle_increment = std::numbers::pi / 360;
  return robot;
}

Transform<Map, Base> place_of(int robot) {
  return Transform<Map, Base>::planar(robot % 2 == 0 ? -3 : 3, robot < 2 ? -2 : 2, 1.5 * robot);
}

tick::Configuration configuration() {
  Scenario scenario;
  scenario.name = "four robots";
  for (int i = 0; i < kRobots; ++i) scenario.robots.push_back({name_of(i), ""});
  for (int i = 0; i < 30; ++i) {
    const double x = -4.2 + 0.9 * (i % 10), y = -0.6 + 0.6 * (i / 10);
    scenario.agents.push_back(test::agent("agent_" + std::to_string(i),
                                          i % 3 == 0 ? AgentKind::person : AgentKind::robot, x, y,
                                          BehaviourKind::wander));
  }
  return *tick::configure_robots(scenario, std::vector<RobotDescription>(kRobots, description()),
                                 test::room());
}

/// What the robot's laser sees of the room.
Scan scan_of(int robot) { return test::exact_scan(*description().laser, place_of(robot), test::room()); }

/// One robot on the bus, until `stop`.
class Publisher {
 public:
  Publisher(int robot, Fault fault) : robot_(robot), fault_(fault), scan_(scan_of(robot)) {}

  void operator()(const std::atomic<bool>& stop) {
    auto bus = open_network_bus(kUrl);
    if (!bus.ok()) return;
    const int per_second = fault_ == Fault::flood ? 1000 : 50;
    const WallTime begun = runtime::steady_now() + milliseconds(7 * robot_);
    for (int i = 0; !stop; ++i) {
      const Duration left = begun + seconds(static_cast<double>(i) / per_second) - runtime::steady_now();
      if (left.ns > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(left.ns));
      const SensorTime now{runtime::wall_now().ns};
      if (fault_ == Fault::flood) send_scan(**bus, now);
      if (i * 50 % per_second == 0) send_slow(**bus, now, i * 50 / per_second);
    }
  }

 private:
  template <class T>
  void send(Bus& bus, const char* canonical, const T& item) {
    encode(item, payload_);
    (void)bus.publish(robot_channel(canonical, name_of(robot_)), payload_);
  }
  void send_scan(Bus& bus, SensorTime now) {
    scan_.stamp = now;
    encode(scan_, payload_);
    if (fault_ == Fault::unreadable_scan) payload_[20] = 0xFF;  // its number of beams
    (void)bus.publish(robot_channel(channel::kScan, name_of(robot_)), payload_);
  }
  void send_slow(Bus& bus, SensorTime now, int i) {
    if (fault_ != Fault::no_pose)
      send(bus, channel::kOdometry, Odometry{now, place_of(robot_).as<Odom, Base>()});
    if (i % 5 != 0) return;
    if (fault_ != Fault::no_scan) send_scan(bus, now);
    if (fault_ == Fault::no_pose) return;
    PoseEstimate estimate;
    estimate.stamp = now;
    estimate.T_map_base = place_of(robot_);
    estimate.covariance = PoseCovariance::Identity() * 1e-6;
    estimate.map_id = "synthetic";
    estimate.state = SlamState::tracking;
    send(bus, channel::kPoseCov, estimate);
  }

  int robot_;
  Fault fault_;
  Scan scan_;
  std::vector<std::uint8_t> payload_;
};

runtime::Report run(const tick::Configuration& configuration, double duration, Fault fault) {
  auto bus = open_network_bus(kUrl);
  if (!bus.ok()) throw std::runtime_error(bus.error().message);
  std::atomic<bool> stop = false;
  runtime::ServeOptions options;
  options.stop = [&stop] { return stop.load(); };
  std::vector<std::thread> robots;
  for (int i = 0; i < kRobots; ++i)
    robots.emplace_back([&, i] { Publisher(i, i == kRobots - 1 ? fault : Fault::none)(stop); });
  std::thread timer([&] {
    std::this_thread::sleep_for(std::chrono::nanoseconds(seconds(duration).ns));
    stop = true;
  });
  auto report = runtime::serve(**bus, configuration, options);
  timer.join();
  for (std::thread& each : robots) each.join();
  if (!report.ok()) throw std::runtime_error(report.error().message);
  return *report;
}

void print(const runtime::Report& report) {
  for (const runtime::RobotReport& each : report.robots) {
    std::printf(
        "  %s: %llu scans, %llu degraded, guard %llu; in the tick p50 %.0f, p99 %.0f us; bus to bus p50 "
        "%.0f, p99 %.0f us\n",
        each.name.c_str(), static_cast<unsigned long long>(each.scans_in),
        static_cast<unsigned long long>(each.scans_degraded),
        static_cast<unsigned long long>(each.guard_fired), each.scan_us.at(0.5), each.scan_us.at(0.99),
        each.scan_in_to_out_us.at(0.5), each.scan_in_to_out_us.at(0.99));
  }
}

/// The 99th percentile of the scans of the three robots without a fault, us.
double others_p99(const runtime::Report& report, bool bus_to_bus) {
  tick::Percentiles all;
  for (int i = 0; i < kRobots - 1; ++i)
    all.add(bus_to_bus ? report.robots[i].scan_in_to_out_us : report.robots[i].scan_us);
  return all.at(0.99);
}

}  // namespace

int main(int argc, char** argv) {
  const double duration = argc > 1 ? std::stod(argv[1]) : 10;
  const int runs = argc > 2 ? std::stoi(argv[2]) : 5;
  const tick::Configuration four = configuration();
  std::array<std::vector<double>, kFaults.size()> tick_us, bus_us;
  for (int i = 0; i < runs; ++i) {
    for (std::size_t f = 0; f < kFaults.size(); ++f) {
      const runtime::Report report = run(four, duration, kFaults[f].first);
      if (i == 0) {
        std::printf("fault of rover_4: %s\n", kFaults[f].second);
        print(report);
      }
      tick_us[f].push_back(others_p99(report, false));
      bus_us[f].push_back(others_p99(report, true));
    }
  }
  std::printf("p99 of the other three robots, median of %d runs of %.0f s:\n", runs, duration);
  for (std::size_t f = 0; f < kFaults.size(); ++f) {
    std::printf("  %-32s in the tick %6.0f us, bus to bus %6.0f us\n", kFaults[f].second, median(tick_us[f]),
                median(bus_us[f]));
  }
  return 0;
}
