#include "server/tick/scan_silence.hpp"

#include <gtest/gtest.h>

namespace parhelion::tick {
namespace {

SimulationTime at_seconds(double s) { return SimulationTime{0} + seconds(s); }

RobotDescription described(double scan_period) {
  RobotDescription robot;
  robot.laser.emplace().scan_period = scan_period;
  return robot;
}

TEST(ScanSilence, ALaserThatIsSlowerThanDescribedIsNotSilent) {
  for (const double scan_period : {0.0, 0.1}) {
    ScanSilence scans(described(scan_period));
    for (int i = 0; i < 40; ++i) {
      scans.add(at_seconds(1.02 * i));
      EXPECT_FALSE(scans.silent(at_seconds(1.02 * (i + 1)))) << scan_period << " s described, scan " << i;
    }
    EXPECT_TRUE(scans.silent(at_seconds(1.02 * 39 + 3.2)));
  }
}

TEST(ScanSilence, TwoScansThatWaitedTogetherAreNoPeriod) {
  ScanSilence scans(described(0));
  scans.add(at_seconds(0));
  scans.add(at_seconds(0.001));
  for (int i = 1; i < 20; ++i) {
    EXPECT_FALSE(scans.silent(at_seconds(i))) << i;
    scans.add(at_seconds(i));
  }
}

}  // namespace
}  // namespace parhelion::tick
