// How good and how fast SLAM is on real recordings, each figure with raw odometry beside it. Not timed by
// iterations: one run.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "fusion/pose/scan_odometry.hpp"
#include "fusion/pose/slam.hpp"
#include "protocols/bus/log_file.hpp"
#include "protocols/codec.hpp"
#include "protocols/pose2.hpp"

namespace parhelion {
namespace {

/// A log that `parhelion import` wrote, decoded.
struct Recording {
  struct Input {
    bool is_scan = false;
    Scan scan;
    Odometry odometry;
  };
  RobotDescription robot;
  std::vector<Input> inputs;
  std::vector<PoseStamped> reference;
  double seconds = 0;
};

template <class T>
bool read(const Message& event, T& item) {
  return decode(event.channel, event.payload, item).ok();
}

bool load(const std::string& path, Recording& recording) {
  auto reader = LogReader::open(path);
  if (!reader) {
    std::printf("  not here: %s\n", reader.error().message.c_str());
    return false;
  }
  ArrivalTime first, last;
  for (;;) {
    auto event = reader->next();
    if (!event || !event->has_value()) break;
    const Message& message = **event;
    Recording::Input input;
    PoseStamped reference;
    RobotMessage robot;
    if (message.channel == "SCAN" && read(message, input.scan)) {
      input.is_scan = true;
      if (first.ns == 0) first = message.arrival;
      last = message.arrival;
      recording.inputs.push_back(std::move(input));
    } else if (message.channel == "ODOMETRY" && read(message, input.odometry)) {
      recording.inputs.push_back(std::move(input));
    } else if (message.channel == "REFERENCE_POSE" && read(message, reference)) {
      recording.reference.push_back(reference);
    } else if (message.channel == "ROBOT" && read(message, robot)) {
      auto description = parse_robot_description(robot.yaml, path);
      if (description) recording.robot = std::move(*description);
    }
  }
  recording.seconds = (last - first).seconds();
  return recording.robot.laser.has_value();
}

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct Run {
  std::vector<std::pair<SensorTime, Pose2>> slam, odometry;  ///< at each scan that was answered
  std::vector<double> wall_ms, cpu_ms;
};

Run run(pose::Slam& slam, const Recording& recording) {
  Run result;
  pose::ScanOdometry odometry;
  Pose2 T_odom_base;
  for (const Recording::Input& input : recording.inputs) {
    if (!input.is_scan) {
      slam.add(input.odometry);
      odometry.add(input.odometry);
      continue;
    }
    const auto wall = std::chrono::steady_clock::now();
    const double cpu = cpu_seconds();
    const auto word = slam.add(input.scan);
    result.cpu_ms.push_back(1e3 * (cpu_seconds() - cpu));
    result.wall_ms.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - wall).count());
    const auto step = odometry.step_to(input.scan.stamp);
    if (!word || !step) continue;
    T_odom_base = T_odom_base * step->step;
    result.slam.emplace_back(word->stamp, planar(word->T_map_base));
    result.odometry.emplace_back(word->stamp, T_odom_base);
  }
  return result;
}

void print_times(const char* what, std::vector<double> ms) {
  std::sort(ms.begin(), ms.end());
  const auto at = [&](double share) {
    return ms[std::min(ms.size() - 1, static_cast<std::size_t>(share * static_cast<double>(ms.size())))];
  };
  std::printf("  step, %s: p50 %.3f p90 %.3f p99 %.3f max %.3f ms\n", what, at(0.5), at(0.9), at(0.99),
              ms.back());
}

/// Mean translational error of relations (Kuemmerle et al. 2009).
void print_relations(const char* what, const std::vector<std::pair<SensorTime, Pose2>>& trajectory,
                     const std::string& path) {
  std::map<std::int64_t, Pose2> at;
  for (const auto& [stamp, pose] : trajectory) at[stamp.utime()] = pose;
  std::ifstream file(path);
  double t1 = 0, t2 = 0, x = 0, y = 0, z = 0, roll = 0, pitch = 0, yaw = 0;
  std::vector<double> errors;
  double turn = 0;
  while (file >> t1 >> t2 >> x >> y >> z >> roll >> pitch >> yaw) {
    const auto a = at.find(std::lround(t1 * 1e6)), b = at.find(std::lround(t2 * 1e6));
    if (a == at.end() || b == at.end()) continue;
    const Pose2 off = Pose2{x, y, yaw}.inverse() * (a->second.inverse() * b->second);
    errors.push_back(off.position().norm());
    turn += std::abs(wrap_angle(off.yaw));
  }
  if (errors.empty()) return;
  double sum = 0;
  for (const double e : errors) sum += e;
  const auto n = static_cast<double>(errors.size());
  std::sort(errors.begin(), errors.end());
  std::printf("  %s: %zu relations, mean %.4f m, median %.4f, p90 %.4f, mean turn %.3f deg\n", what,
              errors.size(), sum / n, errors[errors.size() / 2], errors[errors.size() * 9 / 10],
              turn / n * 57.29578);
}

/// RMSE of position after one rigid alignment; the reference is interpolated at the stamps of the trajectory.
void print_rmse(const char* what, const std::vector<std::pair<SensorTime, Pose2>>& trajectory,
                const Recording& recording) {
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> pairs;
  for (const auto& [stamp, pose] : trajectory) {
    for (std::size_t i = 0; i + 1 < recording.reference.size(); ++i) {
      const PoseStamped &a = recording.reference[i], &b = recording.reference[i + 1];
      if (stamp < a.stamp || stamp > b.stamp) continue;
      const double s = (stamp - a.stamp).seconds() / (b.stamp - a.stamp).seconds();
      pairs.emplace_back(interpolate(planar(a.T_map_base), planar(b.T_map_base), s).position(),
                         pose.position());
      break;
    }
  }
  Eigen::Vector2d mean_a(0, 0), mean_b(0, 0);
  for (const auto& [a, b] : pairs) mean_a += a, mean_b += b;
  mean_a /= static_cast<double>(pairs.size()), mean_b /= static_cast<double>(pairs.size());
  double sine = 0, cosine = 0;
  for (const auto& [a, b] : pairs) {
    const Eigen::Vector2d u = a - mean_a, v = b - mean_b;
    cosine += v.dot(u);
    sine += v.x() * u.y() - v.y() * u.x();
  }
  const Eigen::Rotation2Dd turn(std::atan2(sine, cosine));
  double squares = 0, most = 0;
  for (const auto& [a, b] : pairs) {
    const double d = (a - mean_a - turn * (b - mean_b)).norm();
    squares += d * d;
    most = std::max(most, d);
  }
  std::printf("  %s: RMSE %.1f mm, largest %.1f mm, %zu poses\n", what,
              1e3 * std::sqrt(squares / static_cast<double>(pairs.size())), 1e3 * most, pairs.size());
}

void bench_mapping(const std::string& name, const std::string& log, const std::string& relations) {
  std::printf("%s: mapping\n", name.c_str());
  Recording recording;
  if (!load(log, recording)) return;
  auto mapper = pose::make_mapper(recording.robot, {});
  if (!mapper) return;
  const double start = cpu_seconds();
  Run causal = run(**mapper, recording);
  print_times("wall", causal.wall_ms);
  print_times("CPU", causal.cpu_ms);
  const auto words = (*mapper)->finish();
  const double cpu = cpu_seconds() - start;
  std::printf("  %.1f s of CPU for %.1f s of log: %.0f times real time\n", cpu, recording.seconds,
              recording.seconds / cpu);
  std::vector<std::pair<SensorTime, Pose2>> final;
  for (const PoseEstimate& word : words) final.emplace_back(word.stamp, planar(word.T_map_base));
  if (!relations.empty()) {
    print_relations("final", final, relations);
    print_relations("causal", causal.slam, relations);
    print_relations("raw odometry", causal.odometry, relations);
  }
  if (!recording.reference.empty()) {
    print_rmse("causal", causal.slam, recording);
    print_rmse("final", final, recording);
    print_rmse("raw odometry", causal.odometry, recording);
  }
  // The same drive again in the map that it made.
  const std::string prefix = (std::filesystem::temp_directory_path() / "parhelion_bench_pose").string();
  if (!(*mapper)->save_simplemap(prefix + ".simplemap") || !pose::save_ros_map((*mapper)->grid_map(), prefix))
    return;
  for (const char* kind : {".simplemap", ".yaml"}) {
    pose::SlamOptions options;
    options.start = Eigen::Vector3d::Zero();
    auto localizer = pose::make_localizer(recording.robot, prefix + kind, options);
    if (!localizer) continue;
    std::printf("%s: localization in %s\n", name.c_str(), kind);
    Run located = run(**localizer, recording);
    print_times("wall", located.wall_ms);
    print_times("CPU", located.cpu_ms);
    if (!recording.reference.empty()) print_rmse("causal", located.slam, recording);
  }
  for (const char* kind : {".simplemap", ".yaml", ".pgm"}) std::filesystem::remove(prefix + kind);
}

}  // namespace
}  // namespace parhelion

/// bench_pose_slam SENA.lcm JARVIS.lcm INTEL.lcm: logs that `parhelion import` wrote; "-" leaves one out.
int main(int argc, char** argv) {
  const std::string relations = std::string(PARHELION_DATA_DIR) + "/slam2d-intel/intel.relations";
  if (argc != 4) {
    std::printf("usage: %s SENA.lcm JARVIS.lcm INTEL.lcm (of `parhelion import`; - leaves one out)\n",
                argv[0]);
    return 2;
  }
  const char* names[] = {"SENA", "Jarvis", "Intel"};
  for (int i = 0; i < 3; ++i) {
    if (std::string(argv[i + 1]) != "-")
      parhelion::bench_mapping(names[i], argv[i + 1], i == 2 ? relations : "");
  }
  return 0;
}
