#include "protocols/driving_timing.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <sstream>

#include "protocols/scenario.hpp"

namespace parhelion {
namespace {

/// The page is not C++, so the compiler does not check it against the header.
TEST(DrivingTiming, ThePageUsesTheTimingOfTheServer) {
  std::ifstream file(std::string(PARHELION_SOURCE_DIR) + "/server/station/web/src/drive/sender.ts");
  std::ostringstream text;
  text << file.rdbuf();
  const std::string source = text.str();
  std::smatch found;
  ASSERT_TRUE(std::regex_search(source, found, std::regex("export const beat = (\\d+);")));
  EXPECT_EQ(milliseconds(std::stoi(found[1])), driving_timing::kCommandPeriod);
}

TEST(DrivingTiming, AScenarioDefaultsToTheTimingOfTheServer) {
  EXPECT_EQ(ContactLimits{}.silence, driving_timing::kTeleopSilence.seconds());
}

}  // namespace
}  // namespace parhelion
