// The base station's page in a real browser, as each role uses it: tests/browser/station.mjs says what is
// done.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "tests/tools/process.hpp"

namespace parhelion {
namespace {

const std::string browser_folder = std::string(PARHELION_SOURCE_DIR) + "/tests/browser";

TEST(StationBrowserTest, EachRoleDoesItsWorkFromLogInToTheGradedSession) {
  if (!std::filesystem::exists(browser_folder + "/node_modules/playwright-core")) {
    // tools/test has installed it: there this is a failure.
    ASSERT_EQ(std::getenv("PARHELION_BROWSER"), nullptr) << "no packages in " << browser_folder;
    GTEST_SKIP() << "needs `npm ci` in " << browser_folder;
  }
  const char* kept = std::getenv("PARHELION_BROWSER_PICTURES");
  const std::string pictures = kept ? std::string(kept) : testing::TempDir();
  const auto ran =
      test::run({browser_folder + "/station.mjs", test::program(), PARHELION_SOURCE_DIR, pictures},
                pictures + "/station.txt", "/usr/bin/node");
  EXPECT_EQ(ran.exit, 0) << ran.output;
  EXPECT_NE(ran.output.find("ok  nothing went wrong in any page"), std::string::npos) << ran.output;
}

}  // namespace
}  // namespace parhelion
