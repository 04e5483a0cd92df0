// In which order a laser measures the beams of a message, as `parhelion calibrate` finds it.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/temporary_folder.hpp"
#include "tests/tools/calibration/logged_drive.hpp"
#include "tools/calibration/calibration_log.hpp"

namespace parhelion::tools {
namespace {

constexpr double kSlowSweep = 0.1;  // s, as of a laser that turns ten times a second

Result<CalibrationReport> calibrated_with(std::uint32_t seed, const test::Sweep& sweep) {
  const test::TemporaryFolder folder;
  CalibrationOptions options;
  options.input = folder / "drive.lcm";
  test::LoggedDrive(seed, {}, false, {}, 1.5, sweep).write(options.input);
  return calibrate_log(options);
}

TEST(BeamOrder, IsCorrectedWhereADriverReversesTheBeams) {
  for (const std::uint32_t seed : {11U, 12U}) {
    const auto report = calibrated_with(seed, {kSlowSweep, true});
    ASSERT_TRUE(report.ok()) << report.error().message;
    EXPECT_TRUE(report->reversed_beams);
    EXPECT_EQ(report->after.laser->beam_interval, -report->before.laser->beam_interval);
    EXPECT_EQ(report->verdict, CalibrationVerdict::better);
    ASSERT_FALSE(report->warnings.empty());
    EXPECT_NE(report->warnings.front().find("the last beam of a message is measured first"),
              std::string::npos)
        << report->warnings.front();
  }
}

TEST(BeamOrder, StaysWhereItIsAsDescribed) {
  for (const std::uint32_t seed : {13U, 14U}) {
    const auto report = calibrated_with(seed, {kSlowSweep, false});
    ASSERT_TRUE(report.ok()) << report.error().message;
    EXPECT_FALSE(report->reversed_beams);
    EXPECT_EQ(report->after.laser->beam_interval, report->before.laser->beam_interval);
  }
}

}  // namespace
}  // namespace parhelion::tools
