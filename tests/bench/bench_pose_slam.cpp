// Accuracy and speed of SLAM on real recordings, compared with raw odometry. One run, without timing
// iterations.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "fusion/pose/odometry/scan_odometry.hpp"
#include "fusion/pose/slam.hpp"
#include "protocols/pose2.hpp"
#include "protocols/quantile.hpp"
#include "tests/fusion/pose/estimate_error.hpp"
#include "tests/fusion/pose/recorded_drive.hpp"
#include "tests/fusion/pose/trajectory_error.hpp"

namespace parhelion {
namespace {

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct Run {
  std::vector<PoseEstimate> estimates;
  test::Trajectory slam, odometry;  ///< at each scan that has an estimate
  std::vector<double> wall_ms, cpu_ms;
};

Run run(pose::Slam& slam, const test::RecordedDrive& recording) {
  Run result;
  pose::ScanOdometry odometry;
  Pose2 T_odom_base;
  for (const test::DriveInput& input : recording.inputs) {
    if (!input.scan) {
      slam.add(input.odometry);
      odometry.add(input.odometry);
      continue;
    }
    const auto wall = std::chrono::steady_clock::now();
    const double cpu = cpu_seconds();
    const auto estimate = slam.add(*input.scan);
    result.cpu_ms.push_back(1e3 * (cpu_seconds() - cpu));
    result.wall_ms.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - wall).count());
    const auto step = odometry.step_to(input.scan->stamp);
    if (!estimate || !step) continue;
    T_odom_base = T_odom_base * step->step;
    result.estimates.push_back(*estimate);
    result.slam.emplace_back(estimate->stamp, planar(estimate->T_map_base));
    result.odometry.emplace_back(estimate->stamp, T_odom_base);
  }
  return result;
}

void print_times(const char* what, std::vector<double> ms) {
  std::sort(ms.begin(), ms.end());
  const auto at = [&](double fraction) {
    return ms[std::min(ms.size() - 1, static_cast<std::size_t>(fraction * static_cast<double>(ms.size())))];
  };
  std::printf("  step, %s: p50 %.3f p90 %.3f p99 %.3f max %.3f ms\n", what, at(0.5), at(0.9), at(0.99),
              ms.back());
}

void print_relations(const char* what, const test::Trajectory& trajectory,
                     const std::vector<test::Relation>& relations) {
  const test::RelationError error = test::relation_error(trajectory, relations);
  if (error.relations == 0) return;
  std::printf("  %s: %zu relations, mean %.4f m, median %.4f, p90 %.4f, mean turn %.3f deg\n", what,
              error.relations, error.mean, error.median, error.p90, error.mean_turn * 57.29578);
}

void print_rmse(const char* what, const test::Trajectory& trajectory, const test::RecordedDrive& recording) {
  const test::AlignedError error = test::aligned_error(trajectory, recording.reference);
  std::printf("  %s: RMSE %.1f mm, largest %.1f mm, %zu poses\n", what, 1e3 * error.rmse, 1e3 * error.max,
              error.poses);
}

void print_states(const Run& run) {
  std::map<SlamState, std::size_t> count;
  for (const PoseEstimate& estimate : run.estimates) ++count[estimate.state];
  std::printf("  %zu scans:", run.wall_ms.size());
  for (const auto& [state, scans] : count) std::printf(" %zu %s", scans, to_string(state));
  std::printf("\n");
}

void print_errors(const char* what, test::EstimateErrors errors) {
  if (errors.distances.empty()) return;
  const auto count = static_cast<double>(errors.distances.size());
  std::printf("  tracking, against %s: %zu, p50 %.1f p95 %.1f max %.1f mm;", what, errors.distances.size(),
              1e3 * quantile(errors.distances, 0.5), 1e3 * quantile(errors.distances, 0.95),
              1e3 * quantile(errors.distances, 1));
  constexpr double wrong = 0.3;  // m
  std::printf(
      " beyond 0.3 m %td; in the 95 %% ellipse of x, y %.1f %%, of x, y, yaw %.1f %%\n",
      std::count_if(errors.distances.begin(), errors.distances.end(), [](double d) { return d > wrong; }),
      100 * static_cast<double>(errors.inside_position) / count,
      100 * static_cast<double>(errors.inside_pose) / count);
}

/// Of estimates in state tracking, against the trajectory that the map was made of.
test::EstimateErrors errors_to(const test::Trajectory& final, const Run& run) {
  std::map<std::int64_t, Pose2> at;
  for (const auto& [stamp, pose] : final) at[stamp.ns] = pose;
  test::EstimateErrors errors;
  for (const PoseEstimate& estimate : run.estimates) {
    const auto truth = at.find(estimate.stamp.ns);
    if (truth != at.end() && estimate.state == SlamState::tracking) errors.add(estimate, truth->second);
  }
  return errors;
}

/// The same against certified poses, after one rigid alignment of the positions.
test::EstimateErrors errors_to(const std::vector<PoseStamped>& reference, const Run& run) {
  test::EstimateErrors errors;
  const auto T_reference_map = test::alignment(run.slam, reference);
  for (const PoseEstimate& estimate : run.estimates) {
    const auto truth = test::reference_at(reference, estimate.stamp);
    if (truth && estimate.state == SlamState::tracking)
      errors.add(estimate, T_reference_map->inverse() * *truth);
  }
  return errors;
}

void bench_mapping(const std::string& name, const std::string& log,
                   const std::vector<test::Relation>& relations, const pose::SlamOptions& mapping) {
  std::printf("%s: mapping, %s\n", name.c_str(), to_string(mapping.engine));
  const auto drive = test::recorded_drive(log);
  if (!drive) return;
  const test::RecordedDrive& recording = *drive;
  auto mapper = pose::make_mapper(recording.robot, mapping);
  if (!mapper) {
    std::printf("  %s\n", mapper.error().message.c_str());
    return;
  }
  const double start = cpu_seconds();
  Run causal = run(**mapper, recording);
  print_times("wall", causal.wall_ms);
  print_times("CPU", causal.cpu_ms);
  print_states(causal);
  const test::Trajectory final = test::trajectory_of((*mapper)->finish());
  const double cpu = cpu_seconds() - start;
  std::printf("  %.1f s of CPU for %.1f s of log: %.0f times real time\n", cpu, recording.seconds,
              recording.seconds / cpu);
  print_relations("final", final, relations);
  print_relations("causal", causal.slam, relations);
  print_relations("raw odometry", causal.odometry, relations);
  if (!recording.reference.empty()) {
    print_rmse("causal", causal.slam, recording);
    print_rmse("final", final, recording);
    print_rmse("raw odometry", causal.odometry, recording);
  }
  // The same drive again, localized in its own map.
  const std::string prefix = (std::filesystem::temp_directory_path() / "parhelion_bench_pose").string();
  if (!(*mapper)->save_simplemap(prefix + ".simplemap") || !pose::save_ros_map((*mapper)->grid_map(), prefix))
    return;
  for (const char* kind : {".simplemap", ".yaml"}) {
    pose::SlamOptions options;
    options.start = Eigen::Vector3d(0, 0, 0);
    options.has_odometry = mapping.has_odometry;
    if (mapping.engine != pose::SlamEngine::parhelion) options.engine = pose::SlamEngine::mrpt_localization;
    auto localizer = pose::make_localizer(recording.robot, prefix + kind, options);
    if (!localizer) continue;
    std::printf("%s: localization in %s, %s\n", name.c_str(), kind, to_string(options.engine));
    Run located = run(**localizer, recording);
    print_times("wall", located.wall_ms);
    print_times("CPU", located.cpu_ms);
    print_states(located);
    print_errors("the final trajectory", errors_to(final, located));
    print_errors("certified poses", errors_to(recording.reference, located));
    if (!recording.reference.empty()) print_rmse("causal", located.slam, recording);
  }
  for (const char* kind : {".simplemap", ".yaml", ".pgm"}) std::filesystem::remove(prefix + kind);
}

}  // namespace
}  // namespace parhelion

/// bench_pose_slam ENGINE NAME=LOG...: logs that `parhelion import` wrote. The one that is named Intel is
/// compared with that recording's relations. ENGINE: as of `slam --engine`, for mapping; "mrpt-rbpf=FILE"
/// gives it a configuration file of MRPT, and "scans-alone" is our engine without odometry.
int main(int argc, char** argv) {
  using parhelion::pose::slam_engine;
  const std::string first = argc > 1 ? argv[1] : "";
  const std::size_t equals = std::min(first.find('='), first.size());
  const bool scans_alone = first == "scans-alone";
  const auto engine = slam_engine(scans_alone ? "parhelion" : first.substr(0, equals));
  if (argc < 3 || !engine) {
    std::printf("usage: %s ENGINE[=CONFIGURATION] NAME=LOG.lcm...\n", argv[0]);
    return 2;
  }
  parhelion::pose::SlamOptions options;
  options.engine = *engine;
  options.has_odometry = !scans_alone;
  if (equals < first.size()) options.engine_config = first.substr(equals + 1);
  const auto relations =
      parhelion::test::read_relations(std::string(PARHELION_DATA_DIR) + "/slam2d-intel/intel.relations");
  for (int i = 2; i < argc; ++i) {
    const std::string argument = argv[i];
    const std::string name = argument.substr(0, argument.find('='));
    parhelion::bench_mapping(name, argument.substr(std::min(argument.find('=') + 1, argument.size())),
                             name == "Intel" ? relations : std::vector<parhelion::test::Relation>(), options);
  }
  return 0;
}
