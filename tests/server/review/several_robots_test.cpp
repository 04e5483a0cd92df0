// A session of several robots has a report for each of them.
#include "tests/server/tick/several_robots.hpp"

#include <gmock/gmock.h>

#include "protocols/bus/log_file.hpp"
#include "server/review/review.hpp"
#include "tests/server/tick/tick_fixture.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::review {
namespace {

using namespace test;
using testing::HasSubstr;

class ReviewOfSeveralRobotsTest : public TickTest {
 protected:
  /// rover_1 drives its circle, rover_2 stands beside a barrel and gets a command.
  void SetUp() override {
    Scenario scenario = two_robots({agent("barrel_1", AgentKind::barrel, 3.2, -2.4)});
    Training& training = scenario.training.emplace();
    training.on_command = false;
    Task task;
    task.name = "at the barrel", task.points = 10;
    task.done.kind = Condition::Kind::near;
    task.done.target = "barrel_1", task.done.distance = 1.2, task.done.duration = 0.5;
    training.tasks = {task};
    start(two_robots_configuration(scenario));
    auto log = LogWriter::create(path_, true);
    ASSERT_TRUE(log.ok());
    const auto write = [&](const std::string& channel, ArrivalTime arrival, const auto& payload) {
      ASSERT_TRUE(log->write(channel, arrival, payload).ok());
    };
    std::vector<std::uint8_t> header;
    encode(tick::session_header(configuration_, SensorTime::from_utime(kStartUs - 2000)), header);
    write(channel::kMrSession, ArrivalTime::from_utime(kStartUs - 2000), header);
    std::vector<Message> inputs = two_robots_drive(2);
    inputs.push_back(message(robot_channel(channel::kTeleop, kRover2), kStartUs + 2'100'000,
                             TwistCommand{SensorTime::from_utime(kStartUs + 2'100'000), {0.1, 0, 0}}));
    for (const Message& input : inputs) {
      outputs_.clear();
      tick::tick(configuration_, input, *state_, outputs_, observer_);
      write(input.channel, input.arrival, input.payload);
      for (const tick::Outputs::Entry& entry : outputs_.entries())
        write(entry.channel, input.arrival, entry.payload);
    }
  }
  SessionReview review(const std::string& robot) {
    auto made = review_session(path_, {}, {}, Reader::instructor, robot);
    EXPECT_TRUE(made.ok()) << made.error().message;
    return std::move(*made);
  }

  TemporaryFolder folder_;
  const std::string path_ = folder_ / "session.lcm";
};

TEST_F(ReviewOfSeveralRobotsTest, EachHasItsOwnPathPointsAndPlots) {
  const SessionReview first = review(kRover1), second = review(kRover2);
  EXPECT_EQ(first.path.entity, kRover1);
  EXPECT_EQ(second.path.entity, kRover2);
  ASSERT_TRUE(first.grade && second.grade);
  EXPECT_EQ(first.grade->awarded, 0);
  EXPECT_EQ(second.grade->awarded, 10);
  for (const char* name : {"nearest", "delay_scan"}) {
    EXPECT_EQ(first.series.count(name), 1U) << name;
    EXPECT_EQ(second.series.count(name), 1U) << name;
  }
  EXPECT_EQ(first.series.count("commanded_forward"), 0U) << "nobody drove it";
  EXPECT_EQ(second.series.count("commanded_forward"), 1U);
}

TEST_F(ReviewOfSeveralRobotsTest, TheOthersAreAmongTheAgents) {
  std::vector<std::string> names;
  for (const Trail& agent : review(kRover2).agents) names.push_back(agent.entity);
  EXPECT_THAT(names, testing::Contains(kRover1));
}

TEST_F(ReviewOfSeveralRobotsTest, WithoutANameItIsTheFirst) { EXPECT_EQ(review("").robot, kRover1); }

TEST_F(ReviewOfSeveralRobotsTest, ANameThatIsNotInItIsAnErrorWithTheNames) {
  const auto made = review_session(path_, {}, {}, Reader::instructor, "rover_3");
  ASSERT_FALSE(made.ok());
  EXPECT_THAT(made.error().message, HasSubstr("no robot 'rover_3' in it"));
  EXPECT_THAT(made.error().message, HasSubstr("rover_"));
}

}  // namespace
}  // namespace parhelion::review
