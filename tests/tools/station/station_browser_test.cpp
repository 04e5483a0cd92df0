// The base station's page in a real browser for each role; the steps are in tests/browser: station.mjs,
// crawler.mjs, demo.mjs and every_layout.mjs.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "tests/recordings.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::tools {
namespace {

const std::string kBrowserFolder = std::string(PARHELION_SOURCE_DIR) + "/tests/browser";

bool has_packages() { return std::filesystem::exists(kBrowserFolder + "/node_modules/playwright-core"); }

/// Runs the script to its last step; pictures are stored beside its output.
void play(const std::string& script, std::vector<std::string> options) {
  const char* kept = std::getenv("PARHELION_BROWSER_PICTURES");
  const std::string pictures = kept ? std::string(kept) : testing::TempDir();
  options.insert(options.begin(), kBrowserFolder + "/" + script);
  options.push_back(pictures);
  const auto ran = test::run(options, pictures + "/" + script + ".txt", "/usr/bin/node");
  EXPECT_EQ(ran.exit, 0) << ran.output;
  EXPECT_NE(ran.output.find("ok  nothing went wrong in any page"), std::string::npos) << ran.output;
}

/// tools/test has installed them, so their absence is a failure there.
#define PARHELION_NEEDS_BROWSER_PACKAGES()                                                       \
  if (!has_packages()) {                                                                         \
    ASSERT_EQ(std::getenv("PARHELION_BROWSER"), nullptr) << "no packages in " << kBrowserFolder; \
    GTEST_SKIP() << "needs `npm ci` in " << kBrowserFolder;                                      \
  }

// Not among those that run alone: nothing in it depends on time.
TEST(PageLayouts, AreUsableByKeysAndHaveNoViolationInAnyTheme) {
  PARHELION_NEEDS_BROWSER_PACKAGES();
  play("every_layout.mjs", {test::program(), PARHELION_SOURCE_DIR});
}

TEST(StationBrowserTest, EachRoleWorksFromLogInToTheGradedSession) {
  PARHELION_NEEDS_BROWSER_PACKAGES();
  play("station.mjs", {test::program(), PARHELION_SOURCE_DIR});
}

TEST(StationBrowserTest, ArmAndHeadOfACrawlerMoveInARealRoom) {
  PARHELION_NEEDS_BROWSER_PACKAGES();
  const auto scans = test::recording("3d-room-scan");
  PARHELION_NEEDS_RECORDING(scans);
  play("crawler.mjs", {test::program(), PARHELION_SOURCE_DIR, scans});
}

TEST(StationBrowserTest, LinkUsersDriveInjectAndGradeADemo) {
  PARHELION_NEEDS_BROWSER_PACKAGES();
  PARHELION_NEEDS_RECORDING(test::sena_rawlog());
  play("demo.mjs", {test::program()});
}

}  // namespace
}  // namespace parhelion::tools
