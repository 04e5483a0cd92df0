#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "tests/loop/closed_loop.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::test {
namespace {

TEST(LoopSite, EachSeedHasRoomForItsAgentsAndOtherThingsThanItsSurvey) {
  for (std::uint64_t seed = 0; seed < 1200; ++seed) {
    const Site site = make_site(seed);
    int moved = 0, left = 0;
    for (const Site::Piece& piece : site.furniture) {
      left += !piece.was_there;
      moved += piece.was_there && (piece.now.position() - piece.surveyed.position()).norm() > 0.05;
    }
    EXPECT_GT(moved + left, 0) << seed;
    for (int i = 0; i < kArrangements; ++i)
      EXPECT_NO_THROW(loop_scenario(site, static_cast<Arrangement>(i))) << seed;
  }
}

class ClosedLoop : public ::testing::TestWithParam<Arrangement> {};

/// It may be late on a busy machine, but it does not touch anything.
TEST_P(ClosedLoop, NothingShownIsTouchedAndEachPromiseHolds) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "drive");
  const std::uint64_t seed = 101 + static_cast<std::uint64_t>(GetParam());
  const DriveReport drive = drive_loop(seed, GetParam(), folder / "drive");
  for (const std::string& failure : drive.failures()) ADD_FAILURE() << failure;
  EXPECT_GT(drive.log.scans_shown, 20);
  EXPECT_GT(drive.log.beams_replaced, 100);
  std::printf("%s: %s %s, %d scans, %d of %d commands reduced, nearest %.2f m, score %.1f\n",
              to_string(drive.arrangement), drive.goal.c_str(), drive.other_goal.c_str(), drive.log.scans,
              drive.log.commands_reduced, drive.log.commands, drive.log.nearest_shown, drive.score);
}

TEST(ClosedLoopWithTheArm, AVirtualThingIsLiftedIntoAVirtualTub) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "drive");
  const DriveReport drive = drive_loop(104, Arrangement::trainee_lifts, folder / "drive");
  for (const std::string& failure : drive.failures()) ADD_FAILURE() << failure;
  EXPECT_EQ(drive.goal, "reached");
  EXPECT_EQ(drive.score, 100);
}

INSTANTIATE_TEST_SUITE_P(Arrangements, ClosedLoop,
                         ::testing::Values(Arrangement::trainee_drives, Arrangement::robot_drives_itself,
                                           Arrangement::careless_trainee_drives),
                         [](const auto& param) {
                           std::string name = to_string(param.param);
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

}  // namespace
}  // namespace parhelion::test
