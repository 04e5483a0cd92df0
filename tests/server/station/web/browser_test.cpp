// The built page in a real browser; the checks are in tests/browser/headset.mjs.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "tests/tools/process.hpp"

namespace parhelion::station {
namespace {

const std::string kBrowserFolder = std::string(PARHELION_SOURCE_DIR) + "/tests/browser";

TEST(BrowserTest, HeadsetShowsVirtualObjectsWhereTheControllerPlacedThem) {
  if (!std::filesystem::exists(kBrowserFolder + "/node_modules/iwer")) {
    // tools/test has installed it, so its absence is a failure there.
    ASSERT_EQ(std::getenv("PARHELION_BROWSER"), nullptr) << "no packages in " << kBrowserFolder;
    GTEST_SKIP() << "needs `npm ci` in " << kBrowserFolder;
  }
  const std::string pictures = testing::TempDir();
  const auto ran =
      test::run({kBrowserFolder + "/headset.mjs", pictures}, pictures + "headset.txt", "/usr/bin/node");
  EXPECT_EQ(ran.exit, 0) << ran.output;
  EXPECT_NE(ran.output.find("ok  pictures go on while it is worn"), std::string::npos) << ran.output;
}

}  // namespace
}  // namespace parhelion::station
