#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <numbers>

#include "fusion/cloud/read_cloud.hpp"
#include "fusion/cloud/registration.hpp"
#include "fusion/pose/mapping/pose_graph3.hpp"
#include "tests/fusion/cloud/synthetic_scans.hpp"
#include "tests/recordings.hpp"

namespace parhelion::cloud {
namespace {

using test::pose;

/// Poses around the ring, evenly spaced along its centre line; the last ones equal the first ones.
std::vector<Eigen::Isometry3d> around_the_ring(int count) {
  const double w = 21, h = 15, length = 2 * (w + h);
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < count; ++i) {
    double s = std::fmod(length * 1.02 * i / (count - 1), length);
    if (s < w) {
      poses.push_back(pose(-w / 2 + s, -h / 2, 0, 0));
    } else if ((s -= w) < h) {
      poses.push_back(pose(w / 2, -h / 2 + s, 0, std::numbers::pi / 2));
    } else if ((s -= h) < w) {
      poses.push_back(pose(w / 2 - s, h / 2, 0, std::numbers::pi));
    } else {
      poses.push_back(pose(-w / 2, h / 2 - (s - w), 0, -std::numbers::pi / 2));
    }
  }
  return poses;
}

std::vector<ScanToRegister> drive(const std::vector<Eigen::Isometry3d>& truth, int rings) {
  std::vector<ScanToRegister> scans(truth.size());
  Eigen::Isometry3d odometry = Eigen::Isometry3d::Identity();
  for (std::size_t i = 0; i < truth.size(); ++i) {
    scans[i].name = "scan " + std::to_string(i);
    scans[i].cloud.points =
        test::scan(test::ring_corridor(), truth[i], rings, 0.01, static_cast<unsigned>(i));
    // Wheel slip of 3 % and half a degree too much rotation per step.
    if (i > 0) {
      Eigen::Isometry3d step = truth[i - 1].inverse() * truth[i] * pose(0, 0, 0, 0.01);
      step.translation() *= 1.03;
      odometry = odometry * step;
    }
    scans[i].guess = Transform<Cloud, Scanner>(odometry);
    scans[i].has_guess = true;
  }
  return scans;
}

TEST(RegistrationSequence, ClosesALoopOfManyScans) {
  const bool all = std::getenv("PARHELION_LONG") != nullptr;
  const int count = all ? 300 : 40;
  const std::vector<Eigen::Isometry3d> truth = around_the_ring(count);
  const std::vector<ScanToRegister> scans = drive(truth, 60);
  std::size_t last_done = 0;
  const auto found = register_sequence(scans, {}, [&](std::size_t done, std::size_t) { last_done = done; });
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_EQ(last_done, scans.size());
  double worst = 0, drifted = 0, seconds = 0;
  int left_out = 0;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    seconds += found->scans[i].seconds;
    // Where a wall hides everything across the corridor, the scan is left out.
    left_out += !found->scans[i].converged;
    EXPECT_TRUE(found->scans[i].converged ||
                found->scans[i].why.find("do not determine moving along") != std::string::npos)
        << i << ": " << found->scans[i].why;
    const Eigen::Isometry3d right = truth.front().inverse() * truth[i];
    worst = std::max(worst, (found->scans[i].T_cloud_scan.translation() - right.translation()).norm());
    drifted = std::max(drifted, (scans[i].guess.translation() - right.translation()).norm());
  }
  std::printf("%d scans in %.1f s: %d left out, worst %.3f m off, odometry %.1f m\n", count, seconds,
              left_out, worst, drifted);
  EXPECT_LE(left_out, count * 3 / 100);
  // A pair along a corridor is accurate to about 4 cm (its covariance), which accumulates around the loop.
  EXPECT_LT(worst, 0.3);
  EXPECT_GT(drifted, 1);
  EXPECT_EQ(found->cloud.scans.size(), found->cloud.size());
}

TEST(RegistrationSequence, PlacesAScanOnceItsConnectingScanArrives) {
  // Around a corner: the second scan sees nothing of the first; the last is in between.
  const std::vector<Eigen::Isometry3d> truth = {pose(4, -7.5, 0, 0), pose(10.5, -3.5, 0, 1.4),
                                                pose(9.8, -7.2, 0, 0.8), pose(7.5, -7.5, 0, 0.2)};
  std::vector<ScanToRegister> scans(truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    scans[i].name = std::to_string(i);
    scans[i].cloud.points = test::scan(test::ring_corridor(), truth[i], 80, 0.01, static_cast<unsigned>(i));
    const Eigen::Isometry3d off = i == 0 ? Eigen::Isometry3d::Identity() : pose(0.1, 0.05, 0, 0.02);
    scans[i].guess = Transform<Cloud, Scanner>(truth[0].inverse() * truth[i] * off);
    scans[i].has_guess = true;
  }
  const auto found = register_sequence(scans);
  ASSERT_TRUE(found.ok()) << found.error().message;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_TRUE(found->scans[i].converged) << i << ": " << found->scans[i].why;
    const Eigen::Vector3d right = (truth[0].inverse() * truth[i]).translation();
    EXPECT_LT((found->scans[i].T_cloud_scan.translation() - right).norm(), 0.03) << i;
  }
  EXPECT_TRUE(std::is_sorted(found->cloud.scans.begin(), found->cloud.scans.end()));
}

TEST(RegistrationSequence, RejectsAFitFarFromItsInitialGuess) {
  // The next corridor looks like this one rotated by a quarter turn, 8 m from the scan.
  const std::vector<Eigen::Isometry3d> truth = {pose(4, -7.5, 0, 0), pose(10.6, -2, 0, 1.5)};
  bool leapt = false;
  for (const double size : {0.25, 0.3, 0.35, 0.4}) {
    std::vector<ScanToRegister> scans(2);
    for (std::size_t i = 0; i < 2; ++i) {
      scans[i].cloud.points = test::scan(test::ring_corridor(), truth[i], 80, 0.01, static_cast<unsigned>(i));
      scans[i].guess = Transform<Cloud, Scanner>(truth[0].inverse() * truth[i]);
      scans[i].has_guess = true;
    }
    RegistrationOptions options;
    options.surfel_size = size;
    const auto found = register_sequence(scans, options);
    ASSERT_TRUE(found.ok());
    EXPECT_FALSE(found->scans[1].converged) << size;
    leapt = leapt || found->scans[1].why.find("from where its guess puts it") != std::string::npos;
  }
  EXPECT_TRUE(leapt);
}

TEST(RegistrationSequence, LeavesOutAScanOfAnotherPlaceAndReportsIt) {
  const std::vector<Eigen::Isometry3d> truth = {pose(-1, 0.3, 0, 0), pose(0, 0.2, 0, 0.2),
                                                pose(0.8, 0, 0, 0.4)};
  std::vector<ScanToRegister> scans(3);
  for (std::size_t i = 0; i < 3; ++i) {
    scans[i].name = std::to_string(i);
    scans[i].cloud.points = test::scan(
        i == 1 ? test::Boxes{Eigen::AlignedBox3d(Eigen::Vector3d(2, -4, -3), Eigen::Vector3d(2.5, 4, 3)),
                             Eigen::AlignedBox3d(Eigen::Vector3d(-9, -4, -3), Eigen::Vector3d(9, 4, -2.5))}
               : test::furnished_room(),
        truth[i], 80, 0.005, static_cast<unsigned>(i));
    scans[i].guess = Transform<Cloud, Scanner>(truth[0].inverse() * truth[i]);
    scans[i].has_guess = true;
  }
  const auto found = register_sequence(scans);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_FALSE(found->scans[1].converged);
  EXPECT_FALSE(found->scans[1].why.empty());
  EXPECT_TRUE(found->scans[2].converged) << found->scans[2].why;
  EXPECT_EQ(found->cloud.size(), scans[0].cloud.size() + scans[2].cloud.size());
}

TEST(RegistrationSequence, RefusesNoScansAndEmptyOnes) {
  EXPECT_FALSE(register_sequence({}).ok());
  std::vector<ScanToRegister> scans(1);
  scans[0].name = "empty.ply";
  const auto found = register_sequence(scans);
  ASSERT_FALSE(found.ok());
  EXPECT_NE(found.error().message.find("empty.ply"), std::string::npos);
}

// Reference values of the attribution file, with its tolerance; its yaw is about the upward axis.
TEST(RegistrationSequence, RegistersTheCorridorScans) {
  const auto folder = test::recording("3d-3dtk-corridor");
  PARHELION_NEEDS_RECORDING(folder);
  std::vector<ScanToRegister> scans(3);
  for (std::size_t i = 0; i < 3; ++i) {
    auto file = read_scan(folder / ("scan00" + std::to_string(i) + ".3d"));
    ASSERT_TRUE(file.ok()) << file.error().message;
    ASSERT_TRUE(file->guess.has_value());
    scans[i] = {file->name, std::move(file->cloud), *file->guess, true};
  }
  const auto found = register_sequence(scans);
  ASSERT_TRUE(found.ok()) << found.error().message;
  const Eigen::Vector3d expected[3] = {{0, 0, 0}, {1.514, 0.029, -0.023}, {3.344, 0.065, -0.123}};
  const double yaw[3] = {0, 0.80, 0.46};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_TRUE(found->scans[i].converged) << found->scans[i].why;
    EXPECT_LT((found->scans[i].T_cloud_scan.translation() - expected[i]).norm(), 0.03)
        << i << ": " << found->scans[i].T_cloud_scan.translation().transpose();
    EXPECT_NEAR(found->scans[i].T_cloud_scan.yaw() * 180 / std::numbers::pi, yaw[i], 0.3) << i;
  }
}

TEST(PoseGraph3, ClosesALoopAndDownweightsAFalseOne) {
  const std::vector<Eigen::Isometry3d> truth = around_the_ring(30);
  std::vector<Eigen::Isometry3d> drifted = {truth[0]};
  std::vector<pose::PoseGraph3Edge> edges;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const Eigen::Isometry3d step =
        truth[i - 1].inverse() * truth[i] * pose(0.01, 0.005, 0.004, 0.004, 0.002, -0.003);
    drifted.push_back(drifted.back() * step);
    edges.push_back({i - 1, i, step, 1e4 * Eigen::Matrix<double, 6, 6>::Identity()});
  }
  const Eigen::Matrix<double, 6, 6> sure = 1e6 * Eigen::Matrix<double, 6, 6>::Identity();
  edges.push_back({0, 29, truth[0].inverse() * truth[29], sure, true});
  edges.push_back({3, 20, truth[3].inverse() * truth[20] * pose(5, -3, 1, 1), sure, true});
  const std::vector<Eigen::Isometry3d> found = pose::optimize_pose_graph(drifted, edges);
  double worst = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    worst = std::max(worst, (found[i].translation() - truth[i].translation()).norm());
  EXPECT_GT((drifted.back().translation() - truth.back().translation()).norm(), 1);
  EXPECT_LT((found.back().translation() - truth.back().translation()).norm(), 0.02);
  EXPECT_LT(worst, 0.3);
  EXPECT_TRUE(found.front().isApprox(truth.front()));
}

}  // namespace
}  // namespace parhelion::cloud
