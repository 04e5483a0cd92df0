// Crowds through the whole tick: one stationary real robot, wandering simulated ones, their lasers of 361
// beams at 10 Hz cast and published, MR_WORLD and MR_EVENTS. Prints the real-time factor for various numbers
// of casting threads (with all agents in the solver, and as served), scans encoded per second, percentiles of
// a step, and the rate that another program receives: logged, sent over LCM, received and decoded. Agents are
// upright single bodies with velocity motors bounded by friction, at 240 Hz.
#include <benchmark/benchmark.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include "protocols/quantile.hpp"
#include "server/runtime/outbox.hpp"
#include "server/runtime/thread_pool.hpp"
#include "server/tick/tick.hpp"
#include "tests/server/tick/message.hpp"

namespace {

using namespace parhelion;
using test::message;

constexpr std::int64_t kStart = 1'700'000'000'000'000;
constexpr double kSpacing = 4;  // m between agents at the start

/// The preset of an LMS-200 with ten scans per second, in a separate share folder.
std::string ten_hertz() {
  const auto share = std::filesystem::temp_directory_path() / "parhelion-bench-share";
  std::filesystem::create_directories(share / "fusion/scan/presets");
  std::ofstream(share / "fusion/scan/presets/ten-hertz.yaml")
      << "range_min: 0.02 m\nrange_max: 80 m\nno_return: 81.83 m\ntoo_close: 0 m\nbeam_interval: 18 us\n"
         "scan_period: 100 ms\nnoise_sigma: 5 mm\nquantization: 10 mm\nbeams: 361\nangle_first: -90 deg\n"
         "angle_increment: 0.5 deg\n";
  setenv("PARHELION_SHARE", share.c_str(), 1);
  return "ten-hertz";
}

ModelEntity box(const std::string& name, EntityLabel label, double x, double y, double length, double width) {
  ModelEntity entity;
  entity.name = name;
  entity.label = label;
  entity.T_map_body = Transform<Map, Body>::planar(x, y, 0, 1.25);
  entity.size = {length, width, 2.5};
  return entity;
}

/// `agents` on a grid around the real robot; the first `lasers` of them carry a laser; half of the others are
/// persons. Outer walls, and a pillar for each four agents.
tick::Configuration hall(int agents, int lasers) {
  Scenario scenario;
  scenario.name = "crowd";
  scenario.max_agents = 10'000;
  const int columns = static_cast<int>(std::ceil(std::sqrt(agents + 1)));
  const double half = columns * kSpacing / 2;
  SemanticModel model;
  model.map_id = "hall";
  for (const double sign : {-1.0, 1.0}) {
    model.entities.push_back(
        box(sign < 0 ? "wall 1" : "wall 2", EntityLabel::wall, sign * (half + 1), 0, 0.2, 2 * half));
    model.entities.push_back(
        box(sign < 0 ? "wall 3" : "wall 4", EntityLabel::wall, 0, sign * (half + 1), 2 * half, 0.2));
  }
  const std::string laser = ten_hertz();
  int made = 0;
  for (int cell = 0; cell < columns * columns && made < agents; ++cell) {
    const double x = (cell % columns + 0.5) * kSpacing - half, y = (cell / columns + 0.5) * kSpacing - half;
    if (std::hypot(x, y) < 2.5) continue;
    if (cell % 4 == 0)
      model.entities.push_back(
          box("pillar " + std::to_string(cell), EntityLabel::wall, x + 2, y + 2, 0.4, 0.4));
    AgentDefinition agent;
    agent.kind = made >= lasers && made % 2 == 1 ? AgentKind::person : AgentKind::robot;
    agent.name = "agent_" + std::to_string(made);
    agent.T_map_base = Transform<Map, Base>::planar(x, y, 0.7 * made);
    agent.behaviour.kind = BehaviourKind::wander;
    if (made < lasers) agent.laser = laser;
    scenario.agents.push_back(agent);
    ++made;
  }
  RobotDescription robot;
  robot.laser = *load_laser_preset(laser);
  robot.footprint = {{-0.3, -0.25}, {0.3, -0.25}, {0.3, 0.25}, {-0.3, 0.25}};
  return *tick::configure(scenario, robot, model);
}

class StepClock : public tick::StageObserver {
 public:
  void begin() { last_ = std::chrono::steady_clock::now(); }
  void ended(tick::Stage stage) override {
    const auto now = std::chrono::steady_clock::now();
    if (stage == tick::Stage::physics_step)
      us.push_back(std::chrono::duration<double, std::micro>(now - last_).count());
    last_ = now;
  }
  std::vector<double> us;

 private:
  std::chrono::steady_clock::time_point last_;
};

/// A step's inputs: the real robot stands still.
std::vector<Message> inputs_at(std::int64_t utime) {
  const SensorTime stamp = SensorTime::from_utime(utime);
  PoseEstimate pose;
  pose.stamp = stamp;
  pose.covariance = PoseCovariance::Identity() * 1e-6;
  pose.state = SlamState::tracking;
  pose.map_id = "hall";
  return {message("ODOMETRY", utime + 100, Odometry{stamp, Transform<Odom, Base>::planar(0, 0, 0)}),
          message("POSE_COV", utime + 200, pose)};
}

void crowd(benchmark::State& bench) {
  const tick::Configuration configuration =
      hall(static_cast<int>(bench.range(0)), static_cast<int>(bench.range(1)));
  auto made = tick::make_state(configuration, ArrivalTime::from_utime(kStart),
                               std::make_unique<runtime::ThreadPool>(static_cast<int>(bench.range(2))),
                               bench.range(3) != 0);
  if (!made) return bench.SkipWithError(made.error().message.c_str());
  tick::State& state = **made;
  tick::Outputs outputs;
  StepClock clock;
  std::int64_t utime = kStart;
  std::size_t scans = 0;
  const auto run = [&](double seconds_of_it) {
    const std::int64_t end = utime + static_cast<std::int64_t>(seconds_of_it * 1e6);
    for (; utime < end; utime += 50'000) {
      for (const Message& input : inputs_at(utime)) {
        outputs.clear();
        clock.begin();
        tick::tick(configuration, input, state, outputs, clock);
        for (const tick::Outputs::Entry& entry : outputs.entries()) scans += entry.channel.ends_with("_SCAN");
      }
    }
  };
  run(2);
  clock.us.clear();
  scans = 0;
  double simulated = 0;
  for (auto _ : bench) {
    run(1);
    simulated += 1;
  }
  bench.counters["x_real_time"] = benchmark::Counter(simulated, benchmark::Counter::kIsRate);
  bench.counters["scans_per_s"] = benchmark::Counter(static_cast<double>(scans), benchmark::Counter::kIsRate);
  bench.counters["step_p50_us"] = median(clock.us);
  bench.counters["step_p99_us"] = quantile(clock.us, 0.99, QuantileRank::upper);
}
BENCHMARK(crowd)
    ->ArgNames({"agents", "lasers", "threads", "solve_all"})
    ->Args({50, 50, 1, 0})
    ->Args({50, 50, 2, 0})
    ->Args({100, 100, 1, 1})
    ->Args({100, 100, 2, 1})
    ->Args({100, 100, 1, 0})
    ->Args({100, 100, 2, 0})
    ->Args({100, 0, 1, 1})
    ->Args({100, 0, 1, 0})
    ->Args({1000, 50, 1, 1})
    ->Args({1000, 50, 1, 0})
    ->Args({1000, 50, 2, 0})
    ->Iterations(5)
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

/// Receives and decodes all agents' scans in another process.
class Listener {
 public:
  explicit Listener(Bus& bus) : bus_(bus), thread_([this] { run(); }) {}
  ~Listener() {
    stop_ = true;
    thread_.join();
  }
  std::size_t received_count() const { return received_count_; }

 private:
  void run() {
    Message message;
    Scan scan;
    while (!stop_) {
      const auto received = bus_.receive(message, milliseconds(10));
      if (!received || !*received) continue;
      if (decode(message.channel, message.payload, scan).ok() && scan.ranges.size() == 361) ++received_count_;
    }
  }

  Bus& bus_;
  std::atomic<std::size_t> received_count_ = 0;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

/// End to end: physics, lasers, session log with its hashes, LCM, and a subscriber that decodes the scan.
/// Waits for the subscriber if it is far behind, so that no scan is lost.
void published(benchmark::State& bench) {
  const int agents = static_cast<int>(bench.range(0));
  const tick::Configuration configuration = hall(agents, agents);
  auto made = tick::make_state(configuration, ArrivalTime::from_utime(kStart),
                               std::make_unique<runtime::ThreadPool>(static_cast<int>(bench.range(1))));
  const std::string url = "udpm://239.255.76.67:7799?ttl=0&recv_buf_size=4194304";
  auto bus = open_network_bus(url), ears = open_network_bus(url);
  const auto log = std::filesystem::temp_directory_path() / "parhelion-bench-crowd.lcm";
  auto writer = LogWriter::create(log, true);
  if (!made || !bus || !ears || !writer || !(*ears)->subscribe("MR_AGENT_.*_SCAN", 10'000))
    return bench.SkipWithError("no state, network bus or log");
  runtime::Outbox outbox(bus->get(), std::move(*writer));
  Listener listener(**ears);
  tick::Outputs outputs;
  tick::StageObserver unmeasured;
  std::int64_t utime = kStart;
  std::size_t sent = 0;
  const auto wait_for = [&](std::size_t scans, std::chrono::milliseconds timeout) {
    const auto end = std::chrono::steady_clock::now() + timeout;
    while (listener.received_count() < scans && std::chrono::steady_clock::now() < end)
      std::this_thread::yield();
  };
  const auto run = [&](double seconds_of_it) {
    const std::int64_t end = utime + static_cast<std::int64_t>(seconds_of_it * 1e6);
    for (; utime < end; utime += 50'000) {
      for (const Message& input : inputs_at(utime)) {
        outputs.clear();
        tick::tick(configuration, input, **made, outputs, unmeasured);
        outbox.send(&input, outputs.entries(), input.arrival);
        for (const tick::Outputs::Entry& entry : outputs.entries()) sent += entry.channel.ends_with("_SCAN");
      }
      if (sent > 500) wait_for(sent - 500, std::chrono::milliseconds(1000));
    }
  };
  run(2);
  wait_for(sent, std::chrono::milliseconds(1000));
  const std::size_t received_before = listener.received_count(), sent_before = sent;
  for (auto _ : bench) {
    run(1);
    wait_for(sent, std::chrono::milliseconds(1000));
  }
  const std::size_t received_count = listener.received_count() - received_before;
  bench.counters["scans_per_s"] =
      benchmark::Counter(static_cast<double>(received_count), benchmark::Counter::kIsRate);
  bench.counters["lost"] = static_cast<double>(sent - sent_before) - static_cast<double>(received_count);
  std::filesystem::remove(log);
}
BENCHMARK(published)
    ->ArgNames({"agents", "threads"})
    ->Args({50, 1})
    ->Args({50, 2})
    ->Iterations(10)
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

/// Casting, measuring and encoding alone: all lasers of one step, repeatedly.
void cast(benchmark::State& bench) {
  const int agents = static_cast<int>(bench.range(0));
  const tick::Configuration configuration = hall(agents, agents);
  auto made = tick::make_state(configuration, ArrivalTime::from_utime(kStart),
                               std::make_unique<runtime::ThreadPool>(static_cast<int>(bench.range(1))));
  if (!made) return bench.SkipWithError(made.error().message.c_str());
  tick::State& state = **made;
  tick::Outputs outputs;
  tick::StageObserver unmeasured;
  std::int64_t utime = kStart + 1'000'000;
  do {
    outputs.clear();
    tick::advance(configuration, ArrivalTime::from_utime(utime += 4'000), state, outputs, unmeasured);
  } while (state.lasers.requests.empty());
  std::size_t scans = 0;
  const tick::TickContext context = state.context(configuration, state.simulation.now(), outputs);
  for (auto _ : bench) {
    outputs.clear();
    tick::publish_agent_scans(context, state.site.caster, state.simulation, state.lasers);
    scans += outputs.entries().size();
  }
  bench.counters["scans_per_s"] = benchmark::Counter(static_cast<double>(scans), benchmark::Counter::kIsRate);
}
BENCHMARK(cast)
    ->ArgNames({"robots", "threads"})
    ->Args({50, 1})
    ->Args({50, 2})
    ->Args({1000, 2})
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
