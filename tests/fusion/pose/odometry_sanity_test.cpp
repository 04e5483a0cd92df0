// Odometry that cannot be trusted: faults are named, and the map is as good as scans alone allow.
#include "fusion/pose/odometry/odometry_sanity.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "fusion/pose/slam.hpp"
#include "protocols/quantile.hpp"
#include "tests/fusion/pose/corrupted_odometry.hpp"
#include "tests/fusion/pose/true_drive.hpp"
#include "tests/long_run.hpp"

namespace parhelion::pose {
namespace {

using test::Corruption;
using test::DriveInput;

struct Mapped {
  std::vector<PoseEstimate> causal, final;
  std::vector<OdometryFinding> findings;
};

Mapped mapped(const RobotDescription& robot, const std::vector<DriveInput>& inputs) {
  Mapped result;
  auto slam = make_mapper(robot, {});
  EXPECT_TRUE(slam.ok());
  if (!slam) return result;
  for (const DriveInput& input : inputs) {
    if (!input.scan)
      (*slam)->add(input.odometry);
    else if (const auto estimate = (*slam)->add(*input.scan))
      result.causal.push_back(*estimate);
  }
  result.final = (*slam)->finish();
  result.findings = (*slam)->odometry_findings();
  return result;
}

/// m, median over the drive, relative to the first estimate.
double error_of(const std::vector<PoseEstimate>& estimates, const test::TrueDrive& drive) {
  std::vector<double> errors;
  const Pose2 T_true_map = drive.at(estimates.front().stamp) * planar(estimates.front().T_map_base).inverse();
  for (const PoseEstimate& estimate : estimates) {
    const Pose2 off = drive.at(estimate.stamp).inverse() * (T_true_map * planar(estimate.T_map_base));
    errors.push_back(off.position().norm());
  }
  return median(errors);
}

/// A drive through the office, and its map without any fault.
struct Office {
  explicit Office(const test::TrueDriveOptions& options)
      : drive(test::true_drive(test::office(11), test::robot_with_laser(), options)) {}

  test::TrueDrive drive;
  std::vector<DriveInput> inputs = test::inputs_of(drive);
  Mapped clean = mapped(drive.robot, inputs);
  double error = error_of(clean.final, drive);
};
const Office& office() {
  static const Office office{{}};
  return office;
}
/// Between two scans the robot drives up to 0.3 m, and stamps of odometry jitter.
const Office& office_with_a_slow_laser() {
  static const Office office{{.speed = 1.2, .scan_period = 0.25, .odometry_jitter = 0.04}};
  return office;
}

void expect_named_and_mapped(const Office& office, Corruption corruption, std::uint32_t seed) {
  const test::CorruptionKind& kind = test::kind_of(corruption);
  const auto drive = test::corrupted(office.inputs, corruption, 0.4, seed);
  const Mapped found = mapped(office.drive.robot, drive.inputs);
  ASSERT_FALSE(found.findings.empty()) << kind.name << ": nothing was noticed";
  EXPECT_GE((found.findings.front().since - drive.onset).seconds(), -0.5);
  // A turn on the spot does not tell a dead wheel from a wrong scale: the right name may follow another.
  const auto named = std::find_if(found.findings.begin(), found.findings.end(), [&](const auto& finding) {
    return std::find(kind.right_names.begin(), kind.right_names.end(), finding.fault) !=
           kind.right_names.end();
  });
  ASSERT_NE(named, found.findings.end()) << kind.name << ": " << found.findings.front().text;
  const double after = (named->since - drive.onset).seconds();
  const double error = error_of(found.final, office.drive);
  std::printf("%s: %s after %.1f s; error %.3f m, clean %.3f\n", kind.name, named->text.c_str(), after, error,
              office.error);
  EXPECT_LE(after, 10);
  if (!kind.scans_suffice) return;
  EXPECT_LE(error, 1.5 * office.error + 0.005);
  for (const PoseEstimate& estimate : found.causal) EXPECT_NE(estimate.state, SlamState::lost);
}

class CorruptedOdometry : public ::testing::TestWithParam<int> {};

TEST_P(CorruptedOdometry, IsNamedInTimeAndMapsAsWellAsScansAllow) {
  expect_named_and_mapped(office(), static_cast<Corruption>(GetParam()),
                          static_cast<std::uint32_t>(GetParam()));
}

TEST_P(CorruptedOdometry, IsNamedAndMappedWithFewScansASecond) {
  expect_named_and_mapped(office_with_a_slow_laser(), static_cast<Corruption>(GetParam()),
                          100 + static_cast<std::uint32_t>(GetParam()));
}

/// The map is then turned or mirrored, however well the scans fit it.
TEST(OdometrySanity, ALaserMountedBackwardOrUpsideDownIsNotTrackedOnceThatShows) {
  using enum Corruption;
  for (const Corruption corruption : {laser_backward, laser_upside_down, rotation_flipped}) {
    const Mapped found =
        mapped(office().drive.robot, test::corrupted(office().inputs, corruption, 0.4, 5).inputs);
    ASSERT_FALSE(found.findings.empty());
    std::size_t tracked = 0, after = 0;
    for (const PoseEstimate& estimate : found.causal) {
      if (estimate.stamp < found.findings.front().since + seconds(10)) continue;
      ++after;
      if (estimate.state == SlamState::tracking) ++tracked;
    }
    ASSERT_GT(after, 100U);
    // Odometry that was right before has failed; the laser has not.
    EXPECT_EQ(tracked, corruption == rotation_flipped ? after : 0U) << test::kind_of(corruption).name;
  }
}

/// All in a long run, which has the minutes, else a few that differ most.
std::vector<int> kinds() {
  std::vector<int> all;
  for (int kind = 0; kind < test::kCorruptions; ++kind) all.push_back(kind);
  if (test::long_run()) return all;
  using enum Corruption;
  return {static_cast<int>(rotation_flipped), static_cast<int>(frozen), static_cast<int>(wheel_dead),
          static_cast<int>(stamps_jumped)};
}

INSTANTIATE_TEST_SUITE_P(Kinds, CorruptedOdometry, ::testing::ValuesIn(kinds()), [](const auto& param) {
  return std::string(test::kind_of(static_cast<Corruption>(param.param)).name);
});

/// Straight ahead for 5 s, on the spot for 5 s, in a curve for 5 s, and again; `wrong` makes odometry's twist
/// of the true one, ten times a second. What was found in 300 s.
std::vector<OdometryFinding> found_in(const std::function<Twist2(Twist2)>& wrong) {
  OdometrySanity sanity;
  Pose2 odom;
  for (int i = 0; i < 3000; ++i) {
    const SensorTime now = SensorTime{} + seconds(0.1 * i);
    const Twist2 parts[] = {{0.5, 0, 0}, {0, 0, 0.6}, {0.4, 0, -0.4}};
    const Twist2 twist = parts[i / 50 % 3], measured = i < 100 ? twist : wrong(twist);
    const Pose2 step = moved(measured, 0.1);
    odom = odom * step;
    sanity.add(Odometry{now, transform<Odom, Base>(odom)});
    sanity.add(ScanStep{.stamp = now,
                        .seconds = 0.1,
                        .odometry = step,
                        .scans = moved(twist, 0.1),
                        .position_known = true,
                        .yaw_known = true});
  }
  return sanity.findings();
}

/// A list of a hundred would hide what is wrong.
TEST(OdometrySanity, AFaultDoesNotGetAnotherNameWithEachTurn) {
  const auto reversed = found_in([](Twist2 twist) { return Twist2{-twist.vx, 0, -twist.wz}; });
  ASSERT_FALSE(reversed.empty());
  EXPECT_LE(reversed.size(), 3U);
  EXPECT_EQ(reversed.back().fault, OdometryFault::reversed);
  EXPECT_FALSE(reversed.back().until);

  const double track = 0.5;  // m
  const auto wheel = found_in([&](Twist2 twist) {
    const double right = twist.vx + twist.wz * track / 2;
    return Twist2{right / 2, 0, right / track};
  });
  ASSERT_FALSE(wheel.empty());
  EXPECT_LE(wheel.size(), 5U);
  EXPECT_FALSE(wheel.back().until);
}

/// Where scans do not show how far the robot drives, motion alone cannot.
TEST(OdometrySanity, ThatItFrozeIsNamedAtOnceAndOverOnceItAgreesAgain) {
  OdometrySanity sanity;
  sanity.froze(SensorTime{});
  sanity.froze(SensorTime{});
  ASSERT_EQ(sanity.findings().size(), 1U);
  EXPECT_EQ(sanity.fault(), OdometryFault::frozen);
  for (int i = 0; i < 200; ++i) {
    const Pose2 step{0.05, 0, 0.02};
    sanity.add(ScanStep{.stamp = SensorTime{} + seconds(0.1 * i),
                        .seconds = 0.1,
                        .odometry = step,
                        .scans = step,
                        .position_known = true,
                        .yaw_known = true});
    sanity.add(Odometry{SensorTime{} + seconds(0.1 * i), {}});
  }
  EXPECT_EQ(sanity.fault(), OdometryFault::none);
  EXPECT_TRUE(sanity.findings()[0].until);
}

/// Around an even curve; what odometry says of the way follows the turn in part. Its sums are right.
TEST(OdometrySanity, OnACurveAWrongScaleShowsInThePathAsWell) {
  constexpr double curvature = 0.75;  // rad/m
  const auto on_a_curve = [](double scale) {
    std::vector<MotionPair> pairs;
    for (int i = 0; i < 40; ++i) {
      const double along = 0.25 + 0.05 * std::sin(i), turn = curvature * along + 0.04 * std::cos(1.7 * i);
      MotionPair pair{0.2, {}, {along, 0, turn}, true, true};
      pair.odometry = {scale * (0.6 * along + 0.4 * turn / curvature), 0, scale * turn};
      pairs.push_back(pair);
    }
    return compare(pairs);
  };
  EXPECT_LT(on_a_curve(1).gain(0, 0), 0.65);
  EXPECT_EQ(fault_of(on_a_curve(1)), OdometryFault::none);
  for (const double scale : {0.5, 1.6}) EXPECT_EQ(fault_of(on_a_curve(scale)), OdometryFault::scale) << scale;
}

TEST(OdometrySanity, HasNothingToReportOfOdometryThatIsMerelyLateNoisyOrAFewPercentOff) {
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    test::TrueDriveOptions options;
    options.seed = seed;
    options.odometry_late = 0.04 * seed;
    options.odometry_scale = 0.9 + 0.07 * seed;
    options.people = static_cast<int>(seed);
    const auto drive = test::true_drive(test::office(20 + seed), test::robot_with_laser(), options);
    for (const OdometryFinding& finding : mapped(drive.robot, test::inputs_of(drive)).findings)
      ADD_FAILURE() << "seed " << seed << ": " << finding.text;
  }
}

}  // namespace
}  // namespace parhelion::pose
