// Maps of a large building with long corridors: no loop is closed at the wrong one of many doors.
#include "tests/fusion/pose/corridors.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <numbers>
#include <tuple>

#include "fusion/pose/slam.hpp"
#include "tests/fusion/pose/corrupted_odometry.hpp"
#include "tests/long_run.hpp"

namespace parhelion::pose {
namespace {

struct CorridorDrive {
  const char* name;
  test::CorridorOptions building;
  test::TrueDriveOptions drive;
  int beams = 181;
  double turned = std::numbers::pi;  ///< rad, the laser's field of view
  double range_max = 30;             ///< m
  int laps = 0;                      ///< 0: a small ring, then both; 1: the great one and a part again
};

std::vector<CorridorDrive> corridor_drives() {
  test::TrueDriveOptions usual;
  usual.speed = 0.8;
  usual.scan_period = 0.2;
  usual.odometry_period = 0.1;
  usual.odometry_late = 0.05;
  usual.odometry_scale = 1.03;
  usual.odometry_bend = 0.005;
  usual.range_sigma = 0.015;
  std::vector<CorridorDrive> all{{"two rings", {}, usual},
                                 {"two rings, rooms alike", {}, usual},
                                 {"a great ring", {}, usual},
                                 {"a great ring, rooms alike, bad odometry", {}, usual},
                                 {"a scan a second, people", {}, usual},
                                 {"all doors shut, nothing in the corridors", {}, usual},
                                 {"wide corridors, a laser of 10 m, bad odometry", {}, usual},
                                 {"all around, 6 m, 4 cm of noise", {}, usual},
                                 {"a huge ring", {}, usual},
                                 {"a huge ring, a laser of 8 m", {}, usual}};
  for (const std::size_t i : {1, 3}) all[i].building.alike = true;
  for (const std::size_t i : {2, 3, 8, 9}) all[i].laps = 1;
  for (const std::size_t i : {3, 6}) all[i].drive.odometry_bend = 0.02, all[i].drive.odometry_scale = 1.1;
  all[4].drive.scan_period = 1, all[4].drive.people = 4;
  all[5].building.shut = 1, all[5].building.clutter = 0;
  all[6].building.width = 4, all[6].range_max = 10;
  all[7].beams = 360, all[7].turned = 2 * std::numbers::pi * 359 / 360, all[7].range_max = 6;
  all[7].drive.range_sigma = 0.04;
  for (const std::size_t i : {8, 9}) all[i].building.xs = {0, 110, 220}, all[i].building.ys = {0, 90};
  all[9].range_max = 8;
  return all;
}

std::vector<Eigen::Vector2d> route_of(const CorridorDrive& drive) {
  const auto& x = drive.building.xs;
  const auto& y = drive.building.ys;
  const auto at = [&](std::size_t i, std::size_t j) { return Eigen::Vector2d(x[i], y[j]); };
  if (drive.laps == 0)
    return {at(0, 0), at(1, 0), at(1, 1), at(0, 1), at(0, 0), at(1, 0),
            at(2, 0), at(2, 1), at(1, 1), at(0, 1), at(0, 0), {5, 0}};
  return {at(0, 0), at(2, 0), at(2, 1), at(0, 1), at(0, 0), at(1, 0), at(1, 1), at(2, 1), {x[2], y[1] / 2}};
}

test::TrueDrive corridor_drive(CorridorDrive drive, std::uint32_t seed) {
  drive.building.seed = drive.drive.seed = seed;
  test::TrueBuilding building = test::corridor_building(drive.building);
  building.route = route_of(drive);
  RobotDescription robot = test::robot_with_laser();
  LaserDescription& laser = *robot.laser;
  laser.beams = drive.beams;
  laser.angle_min = -drive.turned / 2;
  laser.angle_increment = drive.turned / (drive.beams - 1);
  laser.beam_interval = 26.7e-3 / drive.beams;
  laser.convention.range_max = static_cast<float>(drive.range_max);
  return test::true_drive(building, robot, drive.drive);
}

struct MapErrors {
  test::RelationError near, loops, causal_near;
};

MapErrors map_errors(const test::TrueDrive& drive) {
  auto slam = make_mapper(drive.robot, {});
  if (!slam.ok()) return {};
  test::Trajectory causal;
  for (const test::DriveInput& input : test::inputs_of(drive)) {
    if (!input.scan) {
      (*slam)->add(input.odometry);
      continue;
    }
    if (const auto estimate = (*slam)->add(*input.scan))
      causal.emplace_back(estimate->stamp, planar(estimate->T_map_base));
  }
  const test::Trajectory final = test::trajectory_of((*slam)->finish());
  const test::TrueRelations truth = test::true_relations(drive);
  return {test::relation_error(final, truth.near), test::relation_error(final, truth.loops),
          test::relation_error(causal, truth.near)};
}

/// Kind of drive and seed of the building.
class CorridorMap : public testing::TestWithParam<std::tuple<int, std::uint32_t>> {};

TEST_P(CorridorMap, ClosesItsLoopsAtTheRightDoors) {
  const auto [kind, seed] = GetParam();
  const CorridorDrive drive = corridor_drives().at(static_cast<std::size_t>(kind));
  const MapErrors errors = map_errors(corridor_drive(drive, seed));
  std::printf(
      "%s, seed %u: near %.4f m, at places visited before %.4f m (90 "
      "%%: %.4f m), causal near %.4f m\n",
      drive.name, seed, errors.near.mean, errors.loops.mean, errors.loops.p90, errors.causal_near.mean);
  EXPECT_GT(errors.near.relations, 300U);
  EXPECT_GT(errors.loops.relations, 50U);
  EXPECT_LT(errors.near.mean, 0.06);
  EXPECT_LT(errors.loops.mean, 0.04);
  EXPECT_LT(errors.loops.p90, 0.1);
  EXPECT_LT(errors.causal_near.mean, 0.09);
}

INSTANTIATE_TEST_SUITE_P(Short, CorridorMap,
                         testing::Values(std::tuple(0, 400U), std::tuple(1, 401U), std::tuple(3, 403U),
                                         std::tuple(4, 404U), std::tuple(4, 456U), std::tuple(6, 406U)));
INSTANTIATE_TEST_SUITE_P(Long, CorridorMap,
                         testing::Combine(testing::Range(0, test::long_run() ? 10 : 0),
                                          testing::Range(410U, 412U)));
/// People who walk along with a robot that scans once a second.
INSTANTIATE_TEST_SUITE_P(LongWithPeople, CorridorMap,
                         testing::Combine(testing::Values(4),
                                          testing::Range(450U, test::long_run() ? 460U : 450U)));

}  // namespace
}  // namespace parhelion::pose
