// The built page in a real browser; the checks are in tests/browser.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "tests/tools/process.hpp"

namespace parhelion::station {
namespace {

const std::string kBrowserFolder = std::string(PARHELION_SOURCE_DIR) + "/tests/browser";

/// Runs a program of tests/browser; `last`: what it reports at its end.
void run_in_browser(const std::string& program, const std::string& last) {
  if (!std::filesystem::exists(kBrowserFolder + "/node_modules/iwer")) {
    // tools/test has installed it, so its absence is a failure there.
    ASSERT_EQ(std::getenv("PARHELION_BROWSER"), nullptr) << "no packages in " << kBrowserFolder;
    GTEST_SKIP() << "needs `npm ci` in " << kBrowserFolder;
  }
  const std::string pictures = testing::TempDir();
  const auto ran = test::run({kBrowserFolder + "/" + program + ".mjs", pictures}, pictures + program + ".txt",
                             "/usr/bin/node");
  EXPECT_EQ(ran.exit, 0) << ran.output;
  EXPECT_NE(ran.output.find(last), std::string::npos) << ran.output;
}

TEST(BrowserTest, HeadsetShowsVirtualObjectsWhereTheControllerPlacedThem) {
  run_in_browser("headset", "ok  pictures go on while it is worn");
}

TEST(BrowserTest, RealWallsHideVirtualPersonsInAnAlignedHeadset) {
  run_in_browser("headset_walls", "ok  a tracked marker aligns the map");
}

TEST(BrowserTest, ARefusedPressIsShown) { run_in_browser("refused", "ok  refusals are shown"); }

}  // namespace
}  // namespace parhelion::station
