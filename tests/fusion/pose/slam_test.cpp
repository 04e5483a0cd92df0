#include "fusion/pose/slam.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "tests/fusion/pose/room.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::pose {
namespace {

using test::Sample;

/// Error of an estimate; both poses relative to the start of the drive.
double error(const PoseEstimate& estimate, const Sample& sample, const Pose2& T_true_map) {
  return (T_true_map * planar(estimate.T_map_base).position() - sample.T_map_base.position()).norm();
}

struct MappedDrive {
  std::vector<test::Segment> walls = test::ring_building();
  RobotDescription robot = test::robot_with_laser();
  std::vector<Sample> samples = test::drive(walls, robot, 1.25, 0.03, 5);
  Pose2 start = samples.front().T_map_base;
};
const MappedDrive& shared_drive() {
  static const MappedDrive drive;
  return drive;
}

std::unique_ptr<Slam> mapped_drive(const MappedDrive& drive, std::vector<PoseEstimate>& causal,
                                   std::vector<PoseEstimate>& final) {
  auto mapper = make_mapper(drive.robot, {});
  EXPECT_TRUE(mapper.ok());
  for (const Sample& sample : drive.samples) {
    (*mapper)->add(sample.odometry);
    if (const auto word = (*mapper)->add(sample.scan)) causal.push_back(*word);
  }
  final = (*mapper)->finish();
  return std::move(*mapper);
}

TEST(Mapper, FollowsADriveAndClosesItsLoop) {
  const MappedDrive& drive = shared_drive();
  std::vector<PoseEstimate> causal, final;
  mapped_drive(drive, causal, final);
  ASSERT_EQ(causal.size(), drive.samples.size());
  ASSERT_EQ(final.size(), drive.samples.size());
  double worst_causal = 0, worst_final = 0;
  for (std::size_t i = 0; i < final.size(); ++i) {
    EXPECT_EQ(causal[i].state, SlamState::tracking);
    EXPECT_TRUE(causal[i].causal);
    EXPECT_FALSE(final[i].causal);
    EXPECT_EQ(final[i].stamp, drive.samples[i].stamp);
    worst_causal = std::max(worst_causal, error(causal[i], drive.samples[i], drive.start));
    worst_final = std::max(worst_final, error(final[i], drive.samples[i], drive.start));
  }
  EXPECT_LT(worst_causal, 0.10);
  EXPECT_LT(worst_final, 0.05);
}

TEST(Mapper, IsDeterministic) {
  const MappedDrive& drive = shared_drive();
  std::vector<PoseEstimate> causal[2], final[2];
  std::string id[2];
  for (int i = 0; i < 2; ++i) id[i] = mapped_drive(drive, causal[i], final[i])->grid_map().id;
  EXPECT_EQ(id[0], id[1]);
  for (std::size_t i = 0; i < final[0].size(); ++i) {
    EXPECT_EQ(final[0][i].T_map_base.isometry().matrix(), final[1][i].T_map_base.isometry().matrix());
    EXPECT_EQ(causal[0][i].covariance, causal[1][i].covariance);
  }
}

TEST(Mapper, PublishesNothingBeforeTheFirstOdometry) {
  const MappedDrive& drive = shared_drive();
  auto mapper = make_mapper(drive.robot, {});
  EXPECT_FALSE((*mapper)->add(drive.samples[0].scan));
  (*mapper)->add(drive.samples[0].odometry);
  EXPECT_TRUE((*mapper)->add(drive.samples[0].scan));
}

TEST(Mapper, RefusesARobotWithoutALaser) {
  const auto mapper = make_mapper(RobotDescription{}, {});
  ASSERT_FALSE(mapper.ok());
  EXPECT_NE(mapper.error().message.find("laser"), std::string::npos);
}

class SlamInAMap : public ::testing::TestWithParam<const char*> {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TemporaryFolder;
    std::vector<PoseEstimate> causal, final;
    const auto mapper = mapped_drive(shared_drive(), causal, final);
    ASSERT_TRUE(mapper->save_simplemap(*folder_ / "map.simplemap").ok());
    ASSERT_TRUE(save_ros_map(mapper->grid_map(), *folder_ / "map").ok());
    id_ = new std::string(mapper->grid_map().id);
  }
  static void TearDownTestSuite() {
    delete folder_;
    delete id_;
  }
  std::unique_ptr<Slam> localizer(const SlamOptions& options) {
    auto made = make_localizer(shared_drive().robot, *folder_ / GetParam(), options);
    EXPECT_TRUE(made.ok()) << made.error().message;
    return std::move(*made);
  }
  /// Another drive in the same building.
  static std::vector<Sample> other_drive() {
    return test::drive(shared_drive().walls, shared_drive().robot, 0.6, -0.04, 99);
  }

  static inline test::TemporaryFolder* folder_ = nullptr;
  static inline std::string* id_ = nullptr;
};

TEST_P(SlamInAMap, TracksFromAStart) {
  SlamOptions options;
  options.start = Eigen::Vector3d(0.1, -0.1, 0.05);
  const auto slam = localizer(options);
  double squares = 0, worst_yaw = 0;
  int inside = 0, words = 0;
  const auto samples = other_drive();
  for (const Sample& sample : samples) {
    slam->add(sample.odometry);
    const auto word = slam->add(sample.scan);
    ASSERT_TRUE(word);
    ASSERT_EQ(word->state, SlamState::tracking);
    EXPECT_EQ(word->map_id, *id_);
    const double off = error(*word, sample, shared_drive().start);
    squares += off * off;
    worst_yaw = std::max(worst_yaw, std::abs(wrap_angle(word->T_map_base.yaw() + shared_drive().start.yaw -
                                                        sample.T_map_base.yaw)));
    const double sigma = std::sqrt(word->covariance(0, 0) + word->covariance(1, 1));
    inside += off < 3 * sigma ? 1 : 0;
    ++words;
  }
  EXPECT_LT(std::sqrt(squares / words), 0.03);
  EXPECT_LT(worst_yaw, 0.02);
  EXPECT_GT(inside, words * 8 / 10) << "the covariance must be honest";
}

TEST_P(SlamInAMap, LocalizesAnywhereAndPublishesNothingBefore) {
  const auto slam = localizer({});
  const auto samples = other_drive();
  int tracking = 0;
  for (std::size_t i = 60; i < samples.size(); ++i) {
    slam->add(samples[i].odometry);
    const auto word = slam->add(samples[i].scan);
    ASSERT_TRUE(word);
    if (word->state != SlamState::tracking) {
      EXPECT_EQ(word->state, SlamState::initializing);
      EXPECT_EQ(tracking, 0) << "once found it stays found";
      continue;
    }
    ++tracking;
    EXPECT_LT(error(*word, samples[i], shared_drive().start), 0.1);
  }
  EXPECT_GT(tracking, 60);
}

TEST_P(SlamInAMap, LosesThePoseOnGarbageScansAndRecovers) {
  SlamOptions options;
  options.start = Eigen::Vector3d::Zero();
  const auto slam = localizer(options);
  const auto samples = other_drive();
  std::mt19937 random(3);
  std::uniform_real_distribution<float> any(0.3F, 6.0F);
  SlamState last = SlamState::initializing;
  bool was_lost = false;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    Scan scan = samples[i].scan;
    const bool garbage = i >= 40 && i < 60;
    if (garbage) {
      for (float& range : scan.ranges) range = any(random);
    }
    slam->add(samples[i].odometry);
    const auto word = slam->add(scan);
    ASSERT_TRUE(word);
    last = word->state;
    was_lost = was_lost || last == SlamState::lost;
    if (!garbage && last == SlamState::tracking) {
      EXPECT_LT(error(*word, samples[i], shared_drive().start), 0.12) << i;
    }
  }
  EXPECT_TRUE(was_lost);
  EXPECT_EQ(last, SlamState::tracking);
}

TEST_P(SlamInAMap, PeopleAroundTheRobotDoNotMoveIt) {
  SlamOptions options;
  options.start = Eigen::Vector3d::Zero();
  const auto slam = localizer(options);
  const auto samples = other_drive();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    Scan scan = samples[i].scan;
    // Three people, about a third of the beams, walking along.
    for (std::size_t beam = 0; beam < scan.ranges.size(); ++beam) {
      if ((beam + 2 * i) % 120 < 40) scan.ranges[beam] = std::min(scan.ranges[beam], 0.9F);
    }
    slam->add(samples[i].odometry);
    const auto word = slam->add(scan);
    ASSERT_TRUE(word);
    ASSERT_EQ(word->state, SlamState::tracking) << i;
    EXPECT_LT(error(*word, samples[i], shared_drive().start), 0.1) << i;
  }
}

TEST_P(SlamInAMap, RejectsAWrongStart) {
  SlamOptions options;
  options.start = Eigen::Vector3d(5, 5, 2);
  const auto slam = localizer(options);
  const auto samples = other_drive();
  for (std::size_t i = 0; i < 20; ++i) {
    slam->add(samples[i].odometry);
    const auto word = slam->add(samples[i].scan);
    ASSERT_TRUE(word);
    EXPECT_NE(word->state, SlamState::tracking);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, SlamInAMap, ::testing::Values("map.simplemap", "map.yaml"),
                         [](const auto& param) {
                           return std::string(param.param) == "map.yaml" ? "RosMap" : "Simplemap";
                         });

}  // namespace
}  // namespace parhelion::pose
