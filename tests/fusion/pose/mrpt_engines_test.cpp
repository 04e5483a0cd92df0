// MRPT's engines behind pose::Slam, on a drive whose truth is known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "fusion/pose/slam.hpp"
#include "protocols/quantile.hpp"
#include "tests/fusion/pose/room.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::pose {
namespace {

using test::TemporaryFolder;

constexpr std::size_t kScans = 160;
using ::testing::HasSubstr;

const std::vector<test::Sample>& ring_drive() {
  static const auto samples = test::drive(test::ring_building(), test::robot_with_laser(), 1, 0.01, 3);
  return samples;
}

std::vector<PoseEstimate> run(Slam& slam, std::size_t count = SIZE_MAX) {
  std::vector<PoseEstimate> estimates;
  for (const test::Sample& sample : ring_drive()) {
    if (estimates.size() >= count) break;
    slam.add(sample.odometry);
    if (auto estimate = slam.add(sample.scan)) estimates.push_back(*estimate);
  }
  return estimates;
}

/// Median distance of estimates to the truth, m, where the map's origin is at `origin`.
double median_error(const std::vector<PoseEstimate>& estimates, const Pose2& origin) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    const Pose2 truth = origin.inverse() * ring_drive()[i].T_map_base;
    errors.push_back((planar(estimates[i].T_map_base).position() - truth.position()).norm());
  }
  return errors.empty() ? std::numeric_limits<double>::infinity() : median(errors);
}

SlamOptions with_engine(SlamEngine engine, std::string config = "") {
  SlamOptions options;
  options.engine = engine;
  options.engine_config = std::move(config);
  return options;
}

std::unique_ptr<Slam> mapper(const SlamOptions& options) {
  auto made = make_mapper(test::robot_with_laser(), options);
  EXPECT_TRUE(made.ok()) << made.error().message;
  return made ? std::move(*made) : nullptr;
}

class MrptMapping : public ::testing::TestWithParam<SlamEngine> {};

TEST_P(MrptMapping, FollowsARobotAndSavesAMapThatOthersLocalizeIn) {
  const auto slam = mapper(with_engine(GetParam()));
  ASSERT_TRUE(slam);
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  const auto causal = run(*slam, kScans);
  EXPECT_EQ(::testing::internal::GetCapturedStdout() + ::testing::internal::GetCapturedStderr(), "");
  ASSERT_EQ(causal.size(), kScans);
  for (const PoseEstimate& estimate : causal) {
    EXPECT_TRUE(estimate.covariance.allFinite());
    EXPECT_EQ(estimate.state, SlamState::tracking);
  }
  const Pose2 origin = ring_drive().front().T_map_base;
  const auto final = slam->finish();
  ASSERT_EQ(final.size(), causal.size());
  std::printf("%s: median error %.3f m causal, %.3f m final\n", to_string(GetParam()),
              median_error(causal, origin), median_error(final, origin));
  EXPECT_LT(median_error(causal, origin), 0.15);
  EXPECT_LT(median_error(final, origin), 0.15);
  EXPECT_FALSE(final.front().causal);
  EXPECT_EQ(final.front().map_id, slam->grid_map().id);

  TemporaryFolder folder;
  ASSERT_TRUE(slam->save_simplemap(folder / "map.simplemap").ok());
  SlamOptions options;
  options.start = Eigen::Vector3d(0, 0, 0);
  auto localizer = make_localizer(test::robot_with_laser(), folder / "map.simplemap", options);
  ASSERT_TRUE(localizer.ok()) << localizer.error().message;
  EXPECT_LT(median_error(run(**localizer, 40), origin), 0.15);
}

TEST_P(MrptMapping, TheSameSeedGivesTheSamePoses) {
  std::vector<PoseEstimate> runs[2];
  for (auto& estimates : runs) estimates = run(*mapper(with_engine(GetParam())), 30);
  ASSERT_EQ(runs[0].size(), runs[1].size());
  for (std::size_t i = 0; i < runs[0].size(); ++i) {
    EXPECT_TRUE(runs[0][i].T_map_base.isometry().matrix() == runs[1][i].T_map_base.isometry().matrix());
    EXPECT_TRUE(runs[0][i].covariance == runs[1][i].covariance);
  }
}

INSTANTIATE_TEST_SUITE_P(Engines, MrptMapping, ::testing::Values(SlamEngine::mrpt_icp, SlamEngine::mrpt_rbpf),
                         [](const auto& engine) {
                           return engine.param == SlamEngine::mrpt_icp ? std::string("Icp") : "Rbpf";
                         });

TEST(MrptLocalization, FindsTheRobotFromAStartAndFollowsIt) {
  const auto own = mapper({});
  run(*own);
  own->finish();
  TemporaryFolder folder;
  ASSERT_TRUE(own->save_simplemap(folder / "map.simplemap").ok());
  SlamOptions options = with_engine(SlamEngine::mrpt_localization);
  options.start = Eigen::Vector3d(0.1, -0.1, 0.05);
  std::vector<PoseEstimate> runs[2];
  for (auto& estimates : runs) {
    auto localizer = make_localizer(test::robot_with_laser(), folder / "map.simplemap", options);
    ASSERT_TRUE(localizer.ok()) << localizer.error().message;
    estimates = run(**localizer, 120);
    EXPECT_EQ(estimates.back().map_id, (*localizer)->grid_map().id);
  }
  const double error = median_error(runs[0], ring_drive().front().T_map_base);
  std::printf("mrpt-localization: median error %.3f m\n", error);
  EXPECT_LT(error, 0.15);
  EXPECT_EQ(runs[0].back().state, SlamState::tracking);
  EXPECT_TRUE(runs[0].back().T_map_base.isometry().matrix() == runs[1].back().T_map_base.isometry().matrix());
}

TEST(MrptConfiguration, FilesThatMrptShipsAreRead) {
  const std::filesystem::path shipped = "/usr/share/mrpt/config_files";
  if (!std::filesystem::exists(shipped)) GTEST_SKIP() << shipped << " is not there (package mrpt-common)";
  mapper(with_engine(SlamEngine::mrpt_icp, shipped / "icp-slam/icp-slam_demo_classic.ini"));
  mapper(with_engine(SlamEngine::mrpt_rbpf, shipped / "rbpf-slam/gridmapping_RBPF_ICPbased_intel.ini"));
}

TEST(MrptConfiguration, AWrongFileIsRefusedWithItsNameSectionAndKey) {
  TemporaryFolder folder;
  const std::string file = folder / "icp.ini";
  const auto refused = [&](const char* text) {
    std::ofstream(file) << text;
    const auto made = make_mapper(test::robot_with_laser(), with_engine(SlamEngine::mrpt_icp, file));
    EXPECT_FALSE(made.ok());
    return made ? std::string() : made.error().message;
  };
  const std::string no_section = refused("[ICP]\nmaxIterations = 3\n");
  EXPECT_THAT(no_section, HasSubstr(file));
  EXPECT_THAT(no_section, HasSubstr("[MappingApplication]"));
  EXPECT_THAT(no_section, HasSubstr("it has [ICP]"));
  const std::string no_map =
      refused("[MappingApplication]\nmatchAgainstTheGrid = 0\n[ICP]\nmaxIterations = 3\n");
  EXPECT_THAT(no_map, HasSubstr(file));
  EXPECT_THAT(no_map, HasSubstr("pointsMap_count"));
  const auto missing =
      make_mapper(test::robot_with_laser(), with_engine(SlamEngine::mrpt_icp, folder / "none"));
  ASSERT_FALSE(missing.ok());
  EXPECT_THAT(missing.error().message, HasSubstr("none: cannot be read"));
}

TEST(MrptConfiguration, EnginesReportWhatTheyAreFor) {
  const RobotDescription robot = test::robot_with_laser();
  EXPECT_THAT(make_mapper(robot, with_engine(SlamEngine::mrpt_localization)).error().message,
              HasSubstr("--map"));
  EXPECT_THAT(make_localizer(robot, "map.yaml", with_engine(SlamEngine::mrpt_icp)).error().message,
              HasSubstr("builds a map"));
  EXPECT_THAT(make_mapper(robot, with_engine(SlamEngine::parhelion, "icp.ini")).error().message,
              HasSubstr("--engine"));
}

}  // namespace
}  // namespace parhelion::pose
