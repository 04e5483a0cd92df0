// That the checks of a drive's log find what they are for.
#include "tests/loop/log_checks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::test {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class LogChecks : public ::testing::Test {
 protected:
  void SetUp() override {
    info_.stamp = scan_.stamp;
    info_.live = true;
    info_.agents = {"box"};
    info_.beam_agent.assign(scan_.ranges.size(), -1);
    augmented_ = scan_;
  }
  /// A log of one scan and one command, with what the test has changed.
  LogFindings check() {
    std::vector<Message> log{message(channel::kScan, kStartUs, scan_)};
    if (answers_) log.push_back(message(channel::kMrScan, kStartUs + 1, augmented_));
    if (answers_) log.push_back(message(channel::kMrScanInfo, kStartUs + 2, info_));
    log.push_back(message(channel::kTeleop, kStartUs + 3, TwistCommand{scan_.stamp, {0.4, 0, 0.2}}));
    log.push_back(message(channel::kMrCmd, kStartUs + 3 + delay_us_, TwistCommand{command_stamp_, command_}));
    write_log(folder_ / "log.lcm", log);
    return check_log(folder_ / "log.lcm", robot(), 0.5);
  }

  const TemporaryFolder folder_;
  Scan scan_ = scan_at(0), augmented_;
  ScanInfo info_;
  bool answers_ = true;
  Twist2 command_{0.2, 0, 0.1};
  SensorTime command_stamp_ = scan_.stamp;
  std::int64_t delay_us_ = 1;
};

TEST_F(LogChecks, FindNothingInALogThatKeepsThePromises) {
  augmented_.ranges[90] = 0.8F;
  info_.beam_agent[90] = 0;
  const LogFindings found = check();
  EXPECT_THAT(found.violations, IsEmpty());
  EXPECT_EQ(found.beams_replaced, 1);
  EXPECT_EQ(found.commands_reduced, 1);
  EXPECT_LT(found.nearest_shown, 0.7);
}

TEST_F(LogChecks, FindARealReturnThatWasLengthened) {
  augmented_.ranges[90] += 0.5F;
  info_.beam_agent[90] = 0;
  EXPECT_THAT(check().violations, Contains(HasSubstr("lengthened")));
}

TEST_F(LogChecks, FindABeamThatChangedWithoutAnAgent) {
  augmented_.ranges[90] -= 0.001F;
  EXPECT_THAT(check().violations, Contains(HasSubstr("not replaced has changed")));
}

TEST_F(LogChecks, FindAScanWithoutAnAnswer) {
  answers_ = false;
  EXPECT_THAT(check().violations, Contains(HasSubstr("has 0 MR_SCAN")));
}

TEST_F(LogChecks, FindAnUnchangedScanWithoutAReason) {
  info_.live = false;
  EXPECT_THAT(check().violations, Contains(HasSubstr("without a reason")));
}

TEST_F(LogChecks, FindACommandThatWasRaisedOrBent) {
  command_ = {0.5, 0, 0.25};
  EXPECT_THAT(check().violations, Contains(HasSubstr("not reduced but changed")));
  command_ = {0.4, 0, 0};
  EXPECT_THAT(check().violations, Contains(HasSubstr("one factor")));
}

TEST_F(LogChecks, FindAMotionThatNobodyAskedForOrNoLongerMeans) {
  delay_us_ = 700'000;
  EXPECT_THAT(check().violations, Contains(HasSubstr("although TELEOP is silent")));
  delay_us_ = 1;
  command_stamp_ = SensorTime::from_utime(kStartUs + 77);
  EXPECT_THAT(check().violations, Contains(HasSubstr("no TELEOP asked for")));
}

}  // namespace
}  // namespace parhelion::test
