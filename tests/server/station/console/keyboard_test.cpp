// Bytes of a terminal to keys, keys to a twist: a key counts as held while it repeats, and no longer.
#include "server/station/console/keyboard.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

namespace parhelion::station {
namespace {

using Keys = std::vector<Key>;

WallTime wall_time(double s) { return WallTime{seconds(s).ns}; }

TEST(Keyboard, ReadsLettersAndArrowsOfBothModes) {
  KeyReader reader;
  EXPECT_EQ(reader.feed("wS +"), (Keys{Key::forward, Key::backward, Key::stop, Key::faster}));
  EXPECT_EQ(reader.feed("\x1b[A\x1bOB\x1b[C\x1b[D"),
            (Keys{Key::forward, Key::backward, Key::right, Key::left}));
  EXPECT_EQ(reader.feed("\x1b[1;5A"), (Keys{Key::forward})) << "with Control";
  EXPECT_EQ(reader.feed("\x1b[3~\x1b[15~y"), Keys{}) << "Delete, F5 and a letter without meaning";
}

TEST(Keyboard, ReadsSplitSequencesAndTakesASingleEscForQuit) {
  KeyReader reader;
  EXPECT_EQ(reader.feed("\x1b"), Keys{});
  EXPECT_EQ(reader.feed("["), Keys{});
  EXPECT_EQ(reader.feed("D"), Keys{Key::left});
  EXPECT_EQ(reader.idle(), Keys{});
  EXPECT_EQ(reader.feed("\x1b"), Keys{});
  EXPECT_EQ(reader.idle(), Keys{Key::quit});
  EXPECT_EQ(reader.feed("\x03"), Keys{Key::quit});
}

RC_GTEST_PROP(Keyboard, SurvivesRandomBytesInRandomPieces, ()) {
  const auto bytes = *rc::gen::container<std::string>(rc::gen::arbitrary<char>());
  KeyReader whole, pieces;
  Keys at_once = whole.feed(bytes), one_by_one;
  for (const char byte : bytes) {
    for (const Key key : pieces.feed({&byte, 1})) one_by_one.push_back(key);
  }
  RC_ASSERT(at_once == one_by_one);
}

TEST(Keyboard, DrivesWhileAKeyRepeatsAndStopsOnRelease) {
  KeyboardDrive drive({});
  drive.press(Key::forward, wall_time(1));
  EXPECT_GT(drive.twist(wall_time(1.65)).vx, 0) << "until a terminal begins to repeat";
  double t = 1.66;
  for (; t < 3; t += 0.04) {
    drive.press(Key::forward, wall_time(t));
    EXPECT_GT(drive.twist(wall_time(t + 0.1)).vx, 0);
  }
  EXPECT_EQ(drive.twist(wall_time(t + 0.15)).vx, 0) << "released: no repeat any more";
}

TEST(Keyboard, FollowsTheLastKeyAndStopsAtOnceOnSpace) {
  KeyboardDrive drive({.speed = 1, .yaw_rate = 2, .joint_speed = 0.5, .first_hold = seconds(1), .hold = {}});
  drive.press(Key::forward, wall_time(0));
  drive.press(Key::right, wall_time(0.1));
  EXPECT_EQ(drive.twist(wall_time(0.2)).vx, 0);
  EXPECT_DOUBLE_EQ(drive.twist(wall_time(0.2)).wz, -1) << "half of the steps";
  drive.press(Key::joint_down, wall_time(0.2));
  EXPECT_DOUBLE_EQ(drive.joint_speed(wall_time(0.3)), -0.25);
  drive.press(Key::stop, wall_time(0.3));
  EXPECT_EQ(drive.twist(wall_time(0.3)).wz, 0);
  EXPECT_EQ(drive.joint_speed(wall_time(0.3)), 0);
  for (int i = 0; i < 20; ++i) drive.press(Key::faster, wall_time(1));
  drive.press(Key::backward_left, wall_time(1));
  EXPECT_DOUBLE_EQ(drive.twist(wall_time(1)).vx, -1);
  EXPECT_DOUBLE_EQ(drive.twist(wall_time(1)).wz, 1);
  for (int i = 0; i < 20; ++i) drive.press(Key::slower, wall_time(1));
  EXPECT_DOUBLE_EQ(drive.twist(wall_time(1)).vx, -0.1);
}

TEST(Keyboard, ChangingTheRobotReleasesTheKey) {
  KeyboardDrive drive({});
  drive.press(Key::forward, wall_time(0));
  drive.press(Key::next_robot, wall_time(0.1));
  EXPECT_EQ(drive.twist(wall_time(0.1)).vx, 0);
}

}  // namespace
}  // namespace parhelion::station
