// Scans that contradict the description or one another: one event when it begins.
#include "server/tick/scan_watch.hpp"

#include <gmock/gmock.h>

#include <functional>

#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using Change = std::function<void(Scan&)>;

class ScanWatchTest : public test::TickTest {
 protected:
  /// The synthetic drive with the scans from the tenth on changed; texts of the events.
  std::vector<std::string> conflicts(const Change& change, const RobotDescription& robot = test::robot(),
                                     double duration = 4) {
    out_.clear();
    start(*configure({}, robot, test::room()));
    std::size_t count = 0;
    for (Message each : test::drive(duration)) {
      if (each.channel == channel::kScan && ++count > 10) {
        Scan scan;
        EXPECT_TRUE(decode(each.channel, each.payload, scan).ok());
        change(scan);
        encode(scan, each.payload);
      }
      feed(each);
    }
    return texts();
  }
  std::vector<std::string> texts() {
    std::vector<std::string> all;
    for (const Event& event : decoded<Event>(channel::kMrEvents)) {
      if (event.kind != EventKind::scans_conflict) continue;
      EXPECT_EQ(event.subject, test::robot().name);
      all.push_back(event.text);
    }
    return all;
  }
};

TEST_F(ScanWatchTest, ScansAsDescribedGiveNoEvent) {
  EXPECT_THAT(conflicts([](Scan&) {}), IsEmpty());
}

TEST_F(ScanWatchTest, AnotherNumberOfBeamsIsReportedOnce) {
  EXPECT_THAT(conflicts([](Scan& scan) { scan.ranges.resize(50); }),
              ElementsAre(AllOf(HasSubstr("50 beams from -90 deg every 1 deg"),
                                HasSubstr("the robot description has 181 beams"))));
}

TEST_F(ScanWatchTest, AFanOfMoreThanAWholeTurnIsReportedAsImpossible) {
  EXPECT_THAT(conflicts([](Scan& scan) { scan.ranges.resize(721, 5.F); }),
              ElementsAre(HasSubstr("a fan of 720 deg, more than a whole turn")));
}

TEST_F(ScanWatchTest, AnotherIncrementIsReported) {
  EXPECT_THAT(conflicts([](Scan& scan) { scan.angle_increment /= 2; }),
              ElementsAre(HasSubstr("every 0.5 deg")));
  EXPECT_THAT(conflicts([](Scan& scan) { scan.angle_increment *= -1; }),
              ElementsAre(HasSubstr("every -1 deg")));
}

// The beams of a preset are those of the sensor's usual settings.
TEST_F(ScanWatchTest, WithoutBeamsOfItsOwnInTheDescriptionTheFirstScanCounts) {
  RobotDescription robot = test::robot();
  robot.laser->preset = "lms-200";
  robot.laser->beams = 361;
  EXPECT_THAT(conflicts([](Scan&) {}, robot), IsEmpty());
  EXPECT_THAT(conflicts([](Scan& scan) { scan.ranges.resize(50); }, robot),
              ElementsAre(HasSubstr("the first scan had 181 beams")));
}

TEST_F(ScanWatchTest, BeamsThatTurnRoundAreReported) {
  EXPECT_THAT(conflicts([](Scan& scan) { std::reverse(scan.ranges.begin(), scan.ranges.end()); }),
              ElementsAre(HasSubstr("in reverse order from this scan on")));
}

TEST_F(ScanWatchTest, AConflictThatComesBackSoonIsOne) {
  int count = 0;
  EXPECT_THAT(conflicts([&](Scan& scan) { scan.ranges.resize(++count % 2 == 0 ? 181 : 50, 5.F); }),
              testing::SizeIs(1));
}

TEST_F(ScanWatchTest, TwoPublishersAreReported) {
  for (const double offset : {-0.07, 0.05}) {  // s, of the second one's stamps
    out_.clear();
    RobotDescription robot = test::robot();
    robot.laser->scan_period = 0.1;
    start(*configure({}, robot, test::room()));
    for (const Message& each : test::drive(8)) {
      feed(each);
      if (each.channel != channel::kScan) continue;
      Scan scan;
      ASSERT_TRUE(decode(each.channel, each.payload, scan).ok());
      scan.stamp = scan.stamp + seconds(offset);
      feed(test::message(channel::kScan, each.arrival.utime() + 50'000, scan));
    }
    EXPECT_THAT(texts(), ElementsAre(HasSubstr("two programs publish on SCAN"))) << offset;
    EXPECT_THAT(texts(), ElementsAre(HasSubstr(offset < 0 ? "not newer than the one before"
                                                          : "20 scans a second by their stamps")))
        << offset;
  }
}

}  // namespace
}  // namespace parhelion::tick
