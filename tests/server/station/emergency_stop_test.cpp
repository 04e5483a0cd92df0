// An emergency stop from a page to the robot's wheels while others try to drive: the service, a bus, the
// tick.
#include <gmock/gmock.h>

#include "server/station/teleop_service.hpp"
#include "tests/server/station/recording_client.hpp"
#include "tests/server/tick/level_1.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::station {
namespace {

class EmergencyStopTest : public test::TickTest {
 protected:
  void SetUp() override {
    start(test::level_1());
    EXPECT_TRUE(server_->subscribe(".*", 10'000).ok());
    open_service();
  }
  void open_service(std::vector<EmergencyStop> held = {}, bool robot_seen = true) {
    TeleopOptions options;
    options.now = [this] { return WallTime{steady_ns_}; };
    options.stamp = [this] { return SensorTime{stamp().ns}; };
    options.robots = {"trainee"};
    options.active_stops = std::move(held);
    service_ = std::make_unique<TeleopService>(*service_bus_, std::move(options));
    TeleopRobot robot;
    robot.driven = {"trainee", channel::kTeleop, channel::kJointCmd};
    robot.joints = {{"arm", "revolute", -1, 1, 0.5}};
    if (robot_seen) service_->set_robots({robot});
  }
  ArrivalTime stamp() const { return ArrivalTime::from_utime(test::kStartUs) + Duration{steady_ns_}; }

  /// Advances time; each 20 ms runs the service, passes the bus's messages to the server, and the server's to
  /// the service.
  void pass(double s) {
    for (int i = 0; i < static_cast<int>(s / 0.02 + 0.5); ++i) {
      steady_ns_ += 20'000'000;
      if (foreign_) foreign_();
      service_->turn();
      serve();
    }
  }
  void serve() {
    Message message;
    std::int64_t within = 0;
    while (*server_->receive(message, Duration{0})) {
      if (drop_orders_ > 0 && message.channel == channel::kMrEmergencyStop) {
        --drop_orders_;
        continue;
      }
      EmergencyStopCommand command;
      if (message.channel == channel::kMrEmergencyStop &&
          decode(message.channel, message.payload, command).ok())
        service_->handle(command);
      message.arrival = ArrivalTime{stamp().ns + 1000 * ++within};
      feed(message);
      receive_outputs();
    }
    outputs_.clear();
    tick::advance(configuration_, ArrivalTime{stamp().ns + 10'000'000}, *state_, outputs_, observer_);
    receive_outputs();
  }
  void receive_outputs() {
    for (const tick::Outputs::Entry& entry : outputs_.entries()) {
      Event event;
      TwistCommand twist;
      Joints joints;
      if (entry.channel == channel::kMrEvents && decode(entry.channel, entry.payload, event).ok())
        service_->handle(event);
      if (entry.channel == channel::kMrCmd && decode(entry.channel, entry.payload, twist).ok())
        wheels_ = std::max({wheels_, std::abs(twist.twist.vx), std::abs(twist.twist.wz)});
      if (entry.channel == channel::kMrJointCmd && decode(entry.channel, entry.payload, joints).ok()) {
        for (const double velocity : joints.velocities) arm_ = std::max(arm_, std::abs(velocity));
      }
    }
  }
  /// Distance in m; commands sent meanwhile are in wheels_ and arm_.
  double distance_driven_in(double s) {
    wheels_ = arm_ = 0;
    const auto place = [this] {
      return state_->simulation.robot_motion("trainee")->T_map_base.translation();
    };
    const Eigen::Vector3d before = place();
    pass(s);
    return (place() - before).head<2>().norm();
  }
  void publish_item(const std::string& channel, const auto& item) {
    std::vector<std::uint8_t> payload;
    encode(item, payload);
    EXPECT_TRUE(console_->publish(channel, payload).ok());
  }
  /// A console on LCM, or a joystick, held all the time.
  void hold_stick(double vx) {
    foreign_ = [this, vx] {
      publish_item(channel::kTeleop, TwistCommand{{stamp().ns}, {vx, 0, 0.2 * vx}});
      publish_item(channel::kJointCmd, Joints{{stamp().ns}, {"arm"}, {}, {vx}, {}});
      publish_item(channel::kOperators,
                   OperatorStatus{{stamp().ns}, "eve", "trainee", OperatorStatus::State::drives, "joystick"});
    };
  }
  void order(const std::string& robot, bool engaged, std::uint64_t request) {
    publish_item(channel::kMrEmergencyStop, EmergencyStopCommand{{stamp().ns}, request, robot, engaged});
  }

  MemoryBusHub hub_;
  std::unique_ptr<Bus> service_bus_ = hub_.connect(), server_ = hub_.connect(), console_ = hub_.connect();
  std::unique_ptr<TeleopService> service_;
  std::function<void()> foreign_;
  std::int64_t steady_ns_ = 1'000'000'000;
  int drop_orders_ = 0;
  double wheels_ = 0, arm_ = 0;  ///< maxima of the published commands
};

TEST_F(EmergencyStopTest, NoConsoleCommandOverridesTheStop) {
  hold_stick(0.4);
  EXPECT_GT(distance_driven_in(2), 0.2);
  EXPECT_GT(arm_, 0);
  ASSERT_TRUE(service_->stop("trainee", "ada").ok());
  pass(0.5);  // braking
  EXPECT_LT(distance_driven_in(2), 0.002);
  EXPECT_EQ(wheels_ + arm_, 0);
  hold_stick(std::nan(""));
  EXPECT_LT(distance_driven_in(0.5), 0.002);
  publish_item(channel::kMrFreeze, AgentFreeze{.request = 77, .all = true, .frozen = false});
  publish_item(channel::kMrFreeze, AgentFreeze{.request = 78, .agent = "trainee", .frozen = false});
  EXPECT_TRUE(console_->publish(channel::kTeleop, std::vector<std::uint8_t>{1, 2, 3}).ok());
  hold_stick(0);  // released and pressed again repeatedly
  pass(0.2);
  hold_stick(0.4);
  EXPECT_LT(distance_driven_in(2), 0.002);
  EXPECT_EQ(wheels_ + arm_, 0);

  ASSERT_TRUE(service_->release_stop("trainee", "ada").ok());
  EXPECT_LT(distance_driven_in(2), 0.002) << "the stick has not been let go";
  EXPECT_EQ(wheels_ + arm_, 0);
  hold_stick(0);
  pass(0.2);
  hold_stick(0.4);
  EXPECT_GT(distance_driven_in(2), 0.2);
  EXPECT_GT(arm_, 0);
}

TEST_F(EmergencyStopTest, AnImmediateResetStillRequiresStickRelease) {
  hold_stick(0.4);
  pass(1);
  ASSERT_TRUE(service_->stop("", "ada").ok());
  pass(0.04);
  ASSERT_TRUE(service_->release_stop("", "ada").ok());
  pass(0.5);
  EXPECT_LT(distance_driven_in(2), 0.002);
  foreign_ = {};  // silence counts as a release, too
  pass(1);
  hold_stick(0.4);
  EXPECT_GT(distance_driven_in(2), 0.2);
}

TEST_F(EmergencyStopTest, LostStopOrdersAreSentAgain) {
  hold_stick(0.4);
  pass(1);
  drop_orders_ = 5;
  ASSERT_TRUE(service_->stop("trainee", "ada").ok());
  pass(1.5);
  EXPECT_EQ(drop_orders_, 0);
  EXPECT_LT(distance_driven_in(2), 0.002);
  EXPECT_EQ(wheels_, 0);
}

TEST_F(EmergencyStopTest, PagesReceiveStopsAndResetsFromAnotherConsole) {
  const auto client = RecordingClient::make(1, "ada", Role::instructor);
  service_->socket().opened(client);
  order("trainee", true, 5);
  pass(0.1);
  ASSERT_EQ(service_->stops().size(), 1U);
  EXPECT_EQ(service_->stops()[0].by, "another console");
  EXPECT_THAT(client->texts("estop").back(), testing::HasSubstr(R"("on":true)"));
  hold_stick(0.4);
  EXPECT_LT(distance_driven_in(1), 0.002);
  ASSERT_TRUE(service_->release_stop("trainee", "ada").ok());
  pass(0.1);
  EXPECT_TRUE(service_->stops().empty());
  ASSERT_TRUE(service_->stop("trainee", "ada").ok());
  pass(0.1);
  order("trainee", false, 6);
  pass(0.5);
  EXPECT_TRUE(service_->stops().empty());
  EXPECT_THAT(client->texts("estop").back(), testing::HasSubstr(R"("on":false)"));
  EXPECT_FALSE(state_->robots.front().command.emergency_stop);
  order("nobody", true, 7);  // refused, no effect
  pass(0.5);
  EXPECT_TRUE(service_->stops().empty());
  order("", true, 8);  // every robot
  pass(0.5);
  EXPECT_EQ(service_->stops().size(), 1U);
  EXPECT_TRUE(state_->robots.front().command.emergency_stop);
}

TEST_F(EmergencyStopTest, StopsTheRobotOfAServerThatHasJustStarted) {
  open_service({}, false);
  for (const std::string robot : {"", "trainee"}) {
    const Status stopped = service_->stop(robot, "ada");
    EXPECT_TRUE(stopped) << stopped.error().message;
  }
  EXPECT_FALSE(service_->stop("nobody", "ada"));
  pass(0.1);
  EXPECT_TRUE(state_->robots.front().command.emergency_stop);
  ASSERT_EQ(service_->stops().size(), 1U);
  EXPECT_EQ(service_->stops()[0].robot, "trainee");
}

TEST_F(EmergencyStopTest, AServiceOpenedAfterACrashStopsTheRobotAndReportsIt) {
  hold_stick(0.4);
  pass(1);
  open_service({{"trainee", "the server that died"}});
  const auto client = RecordingClient::make(1, "ada", Role::instructor);
  service_->socket().opened(client);
  EXPECT_THAT(client->texts("estop").at(0), testing::HasSubstr("died"));
  pass(0.5);
  EXPECT_LT(distance_driven_in(2), 0.002);
  EXPECT_TRUE(state_->robots.front().command.emergency_stop);
}

}  // namespace
}  // namespace parhelion::station
