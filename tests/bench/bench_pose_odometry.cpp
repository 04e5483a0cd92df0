// Recorded drives whose odometry is made to fail: which fault is named and when, and what the map is worth
// then. No timing iterations.
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "fusion/pose/slam.hpp"
#include "tests/fusion/pose/corrupted_odometry.hpp"
#include "tests/fusion/pose/recorded_drive.hpp"
#include "tests/fusion/pose/trajectory_error.hpp"

namespace parhelion {
namespace {

struct Run {
  test::Trajectory causal, final;
  std::vector<pose::OdometryFinding> findings;
  std::size_t tracking = 0, unsure = 0, lost = 0;  ///< scans
};

Run run(const RobotDescription& robot, const std::vector<test::DriveInput>& inputs) {
  Run result;
  auto slam = pose::make_mapper(robot, {});
  if (!slam) return result;
  for (const test::DriveInput& input : inputs) {
    if (!input.scan) {
      (*slam)->add(input.odometry);
      continue;
    }
    const auto estimate = (*slam)->add(*input.scan);
    if (!estimate) continue;
    result.causal.emplace_back(estimate->stamp, planar(estimate->T_map_base));
    result.tracking += estimate->state == SlamState::tracking ? 1 : 0;
    result.unsure += estimate->state == SlamState::unsure ? 1 : 0;
    result.lost += estimate->state == SlamState::lost ? 1 : 0;
  }
  result.final = test::trajectory_of((*slam)->finish());
  result.findings = (*slam)->odometry_findings();
  return result;
}

/// Of the recording, or of its clean trajectory over 4 s.
using Relations = std::vector<test::Relation>;

Relations relations_of(const test::Trajectory& trajectory) {
  Relations relations;
  std::size_t second = 0;
  for (std::size_t first = 0; first < trajectory.size(); first += 7) {
    while (second < trajectory.size() && (trajectory[second].first - trajectory[first].first).seconds() < 4)
      ++second;
    if (second == trajectory.size()) break;
    relations.push_back({trajectory[first].first, trajectory[second].first,
                         trajectory[first].second.inverse() * trajectory[second].second});
  }
  return relations;
}

void print(const char* what, const Run& run, const Relations& relations,
           const std::vector<PoseStamped>& reference, SensorTime onset) {
  std::printf("  %-20s final %.3f causal %.3f m", what, test::relation_error(run.final, relations).mean,
              test::relation_error(run.causal, relations).mean);
  std::printf(" RMSE %6.3f m; %5zu tracking %4zu unsure %4zu lost;",
              test::aligned_error(run.final, reference).rmse, run.tracking, run.unsure, run.lost);
  for (const pose::OdometryFinding& finding : run.findings) {
    std::printf(" %s %+.1f", to_string(finding.fault), (finding.since - onset).seconds());
    if (finding.until) std::printf("..%+.1f", (*finding.until - onset).seconds());
  }
  std::printf("\n");
  std::fflush(stdout);
}

void bench(const std::string& name, const std::string& log, const Relations& published, double fraction,
           std::uint32_t seed) {
  std::printf("%s\n", name.c_str());
  const auto drive = test::recorded_drive(log);
  if (!drive) return;
  const Run clean = run(drive->robot, drive->inputs);
  const Relations relations = published.empty() ? relations_of(clean.final) : published;
  std::vector<PoseStamped> reference = drive->reference;
  if (reference.empty()) {
    for (const auto& [stamp, pose] : clean.final) reference.push_back({stamp, transform<Map, Base>(pose)});
  }
  print("clean", clean, relations, reference, clean.final.empty() ? SensorTime{} : clean.final.front().first);
  for (int i = 0; i < test::kCorruptions; ++i) {
    const auto corruption = static_cast<test::Corruption>(i);
    const auto bad =
        test::corrupted(drive->inputs, corruption, fraction, seed + static_cast<std::uint32_t>(i));
    print(test::kind_of(corruption).name, run(drive->robot, bad.inputs), relations, reference, bad.onset);
  }
}

}  // namespace
}  // namespace parhelion

/// bench_pose_odometry FRACTION SEED NAME=LOG...: faults begin after this fraction of the drive. The log that
/// is named Intel is compared with that recording's relations, others with their reference poses or, without
/// any, with their own clean trajectory.
int main(int argc, char** argv) {
  if (argc < 4) {
    std::printf("usage: %s FRACTION SEED NAME=LOG.lcm...\n", argv[0]);
    return 2;
  }
  const auto relations =
      parhelion::test::read_relations(std::string(PARHELION_DATA_DIR) + "/slam2d-intel/intel.relations");
  for (int i = 3; i < argc; ++i) {
    const std::string argument = argv[i];
    const std::string name = argument.substr(0, argument.find('='));
    parhelion::bench(name, argument.substr(std::min(argument.find('=') + 1, argument.size())),
                     name == "Intel" ? relations : parhelion::Relations(), std::stod(argv[1]),
                     static_cast<std::uint32_t>(std::stoul(argv[2])));
  }
  return 0;
}
