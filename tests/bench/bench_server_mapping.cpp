// Mapping while the server runs: sessions with and without it alternate on the same input. A robot drives
// through the synthetic site with 75 scans a second and a depth camera with 102,400 used pixels; agents
// wander. Prints the scan path of both kinds of session, and the latency from a view to cloud and model.
//   bench_server_mapping [ROUNDS [SECONDS]]
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <numbers>
#include <thread>
#include <vector>

#include "fusion/scan/building_tree.hpp"
#include "fusion/scan/lidar_model.hpp"
#include "fusion/scan/ray_caster.hpp"
#include "protocols/quantile.hpp"
#include "server/runtime/live_site.hpp"
#include "server/runtime/loop.hpp"
#include "server/runtime/wall_clock.hpp"
#include "tests/synthetic_site.hpp"

namespace {

using namespace parhelion;

constexpr int kSide = 640;    // pixels of the depth image each way; every second of every second row counts
constexpr double kRate = 75;  // scans a second
constexpr double kLap = 8;    // s for the way around the room
constexpr double kViewsEach = 0.35;  // s between depth images

/// Around the larger room, with a look through the doorway.
Transform<Map, Base> pose_at(double t) {
  const double angle = 2 * std::numbers::pi * t / kLap;
  return Transform<Map, Base>::planar(0.3 + 1.2 * std::cos(angle), 0.8 * std::sin(angle),
                                      angle + std::numbers::pi / 2);
}

RobotDescription robot() {
  RobotDescription robot;
  robot.name = "mapper";
  robot.laser = *load_laser_preset("lms-200");
  robot.laser->T_base_laser = Transform<Base, Laser>::planar(0.2, 0, 0, 0.3);
  robot.footprint = {{-0.3, -0.25}, {0.3, -0.25}, {0.3, 0.25}, {-0.3, 0.25}};
  DepthCameraDescription depth;
  depth.intrinsics = {kSide, kSide, 400, 400, 0.5 * kSide - 0.5, 0.5 * kSide - 0.5, {}, {}};
  depth.range_min = 0.3;
  depth.range_max = 8;
  Eigen::Matrix3d R_base_optical;  // looks ahead, level
  R_base_optical << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  depth.T_base_optical = Transform<Base, DepthOptical>(Eigen::Quaterniond(R_base_optical), {0.2, 0, 1.0});
  robot.depth = depth;
  return robot;
}

/// Initial model: floor and outer walls.
SemanticModel known() {
  SemanticModel model = test::synthetic_site();
  model.map_id = "site";
  std::erase_if(model.entities, [](const ModelEntity& e) {
    return e.name.find("middle") != std::string::npos || e.name == "wall west" ||
           e.label == EntityLabel::unknown || e.label == EntityLabel::stairs ||
           e.label == EntityLabel::pillar;
  });
  return model;
}

tick::Configuration configuration(bool mapping, const SemanticModel& model) {
  Scenario scenario;
  scenario.mapping = mapping;
  for (int i = 0; i < 8; ++i) {
    AgentDefinition agent;
    agent.kind = i % 2 == 0 ? AgentKind::robot : AgentKind::box;
    agent.name = "agent_" + std::to_string(i);
    agent.T_map_base = Transform<Map, Base>::planar(-2.2 + 0.6 * i, i % 2 == 0 ? 2.0 : -2.2, 0);
    if (agent.kind == AgentKind::robot) agent.behaviour.kind = BehaviourKind::wander;
    scenario.agents.push_back(agent);
  }
  auto made = tick::configure(scenario, robot(), model);
  if (!made) std::fprintf(stderr, "%s\n", made.error().message.c_str()), std::exit(1);
  return *made;
}

Image depth_image(const scan::BuildingTree& site, double t) {
  const RobotDescription description = robot();
  const CameraIntrinsics& lens = description.depth->intrinsics;
  const auto T_map_optical = pose_at(t) * description.depth->T_base_optical;
  Image image;
  image.width = image.height = kSide;
  image.row_stride = 2 * kSide;
  image.format = PixelFormat::depth_mm;
  image.metadata.push_back({"encoding", {'r', 'a', 'w'}});
  std::vector<std::uint16_t> millimetres(static_cast<std::size_t>(kSide) * kSide, 0);
  for (int v = 0; v < kSide; v += 2) {
    for (int u = 0; u < kSide; u += 2) {
      const Eigen::Vector3d ray((u - lens.cx) / lens.fx, (v - lens.cy) / lens.fy, 1);
      const auto hit =
          site.cast(T_map_optical.translation(), T_map_optical.rotation() * ray.normalized(), 12);
      const double depth = hit.range / ray.norm();
      if (depth < 8)
        millimetres[static_cast<std::size_t>(v) * kSide + static_cast<std::size_t>(u)] =
            static_cast<std::uint16_t>(std::lround(1000 * depth));
    }
  }
  image.bytes.resize(2 * millimetres.size());
  std::memcpy(image.bytes.data(), millimetres.data(), image.bytes.size());
  return image;
}

/// Messages without stamps.
struct Drive {
  std::vector<Scan> scans;    ///< 75 a second
  std::vector<Image> images;  ///< one every kViewsEach
};

Drive drive(double duration) {
  Drive result;
  const SemanticModel site = test::synthetic_site();
  const scan::BuildingTree tree(site);
  scan::RayCaster caster;
  caster.set_building(site);
  const LaserDescription laser = *robot().laser;
  std::vector<float> time;
  scan::beam_times(laser, static_cast<std::size_t>(laser.beams), time);
  for (int i = 0; i < kRate * duration; ++i) {
    Scan scan;
    scan.angle_min = static_cast<float>(laser.angle_min);
    scan.angle_increment = static_cast<float>(laser.angle_increment);
    std::vector<scan::RangeHit> hits(time.size());
    const auto T_map_laser = pose_at(i / kRate) * laser.T_base_laser;
    caster.cast_building({T_map_laser, T_map_laser}, {scan.angle_min, scan.angle_increment, time}, 30, hits);
    for (const scan::RangeHit& hit : hits)
      scan.ranges.push_back(std::isinf(hit.range) ? laser.convention.no_return_sentinel() : hit.range);
    result.scans.push_back(scan);
  }
  for (double t = 0; t < duration; t += kViewsEach) result.images.push_back(depth_image(tree, t));
  return result;
}

template <class T>
void publish(Bus& bus, const char* channel, const T& item) {
  std::vector<std::uint8_t> payload;
  encode(item, payload);
  (void)bus.publish(channel, payload);
}

/// Plays the drive in real time with current stamps.
void play(Bus& bus, const Drive& drive, double duration) {
  const WallTime begun = runtime::wall_now();
  std::size_t image = 0;
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    const double t = static_cast<double>(i) / kRate;
    if (t >= duration) return;
    const WallTime due = begun + seconds(t);
    const Duration left = due - runtime::wall_now();
    if (left.ns > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(left.ns));
    const SensorTime stamp{due.ns};
    publish(bus, channel::kOdometry, Odometry{stamp, pose_at(t).as<Odom, Base>()});
    PoseEstimate pose;
    pose.stamp = stamp;
    pose.T_map_base = pose_at(t);
    pose.covariance = PoseCovariance::Identity() * 1e-5;
    pose.state = SlamState::tracking;
    pose.map_id = "site";
    publish(bus, channel::kPoseCov, pose);
    Scan scan = drive.scans[i];
    scan.stamp = stamp;
    publish(bus, channel::kScan, scan);
    if (static_cast<double>(image) * kViewsEach > t || image >= drive.images.size()) continue;
    Image depth = drive.images[image++];
    depth.stamp = stamp;
    publish(bus, channel::kDepth, depth);
  }
}

struct Session {
  runtime::Report report;
  tick::Percentiles view_us;  ///< from a view to its effect on cloud and model
  std::size_t points = 0;     ///< of the cloud at the end
  SemanticModel model;        ///< the last
};

Session session(const Drive& drive, bool mapping, const SemanticModel& model, double duration,
                const std::string& log) {
  MemoryBusHub hub;
  const auto server_bus = hub.connect(), robot_bus = hub.connect();
  const tick::Configuration setup = configuration(mapping, model);
  runtime::LiveSite site(setup.model);
  Session result;
  std::atomic<bool> stop = false, started = false;
  runtime::ServeOptions options;
  options.session = log;
  options.overwrite = true;
  options.stop = [&] { return stop.load(); };
  options.notify = [&](const std::string&) { started = true; };
  options.update_site = [&](const runtime::SiteView& view) {
    const WallTime begun = runtime::steady_now();
    auto made = site.add(view);
    result.view_us.add((runtime::steady_now() - begun).microseconds());
    if (made && *made) result.model = **made;
    return made;
  };
  std::thread server([&] {
    auto report = runtime::serve(*server_bus, setup, options);
    if (!report) std::fprintf(stderr, "%s\n", report.error().message.c_str()), std::exit(1);
    result.report = std::move(*report);
  });
  while (!started) std::this_thread::yield();
  play(*robot_bus, drive, duration);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));  // the end of the session must not affect the
                                                                // last scan
  stop = true;
  server.join();
  result.points = site.cloud().size();
  return result;
}

}  // namespace

int main(int count, char** words) {
  const int rounds = count > 1 ? std::atoi(words[1]) : 4;
  const double duration = count > 2 ? std::atof(words[2]) : 8;
  const Drive input = drive(duration);
  const std::string log = (std::filesystem::temp_directory_path() / "bench-mapping.lcm").string();
  enum Kind : std::size_t { without, with, without_in_its_model };
  constexpr const char* names[] = {"without mapping", "with mapping", "without, in its model"};
  std::vector<double> p50[3], p99[3], maxima[3];
  SemanticModel grown = known();
  for (int i = 0; i < 3 * rounds; ++i) {
    const auto kind = static_cast<Kind>(i % 3);
    const Session done =
        session(input, kind == with, kind == without_in_its_model ? grown : known(), duration, log);
    const tick::Percentiles& path = done.report.scan_in_to_out_us;
    p50[kind].push_back(path.at(0.5));
    p99[kind].push_back(path.at(0.99));
    maxima[kind].push_back(path.max());
    std::printf(
        "%-21s scan in to out p50 %5.0f us  p90 %5.0f  p99 %6.0f  max %6.0f (%llu scans, guard %llu)\n",
        names[kind], path.at(0.5), path.at(0.9), path.at(0.99), path.max(),
        static_cast<unsigned long long>(path.count()),
        static_cast<unsigned long long>(done.report.guard_fired));
    if (kind == with) {
      grown = done.model;
      std::printf("    into cloud and model p50 %.0f ms, longest %.0f ms; %zu points, %zu entities; %s\n",
                  done.view_us.at(0.5) / 1e3, done.view_us.max() / 1e3, done.points, grown.entities.size(),
                  done.report.notes.at("mapping").c_str());
    }
    if (done.report.tally.refused_inputs > 0)
      std::printf("    refused: %s\n", done.report.tally.last_refusal.c_str());
    std::fflush(stdout);
  }
  std::filesystem::remove(log);
  for (const auto& [what, values] : {std::pair{"p50", p50}, {"p99", p99}, {"max", maxima}}) {
    const double a = median(values[without]), b = median(values[with]),
                 c = median(values[without_in_its_model]);
    std::printf(
        "median %s: without %.0f us, with %.0f us (%+.1f %%), without in its model %.0f us (with: %+.1f "
        "%%)\n",
        what, a, b, 100 * (b / a - 1), c, 100 * (b / c - 1));
  }
  return 0;
}
