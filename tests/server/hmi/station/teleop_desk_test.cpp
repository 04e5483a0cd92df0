// What can move a robot fails to a stop.
#include "server/hmi/station/teleop_desk.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <map>

#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/hmi/station/operator_name.hpp"
#include "tests/server/hmi/station/stand_in_client.hpp"

namespace parhelion {
namespace {

constexpr const char* agent_teleop = "MR_AGENT_robot_2_TELEOP";

class TeleopDeskTest : public testing::Test {
 protected:
  TeleopDeskTest() : desk_bus_(hub_.connect()), server_(hub_.connect()) {
    EXPECT_TRUE(server_->subscribe(".*", 10000).ok());
    desk_ = std::make_unique<TeleopDesk>(
        *desk_bus_,
        TeleopOptions{
            [this] { return now_; }, [this] { return SensorTime{1'700'000'000'000'000'000 + now_.ns}; },
            [this](const std::string& who, const std::string& what) { audited_.push_back(who + " " + what); },
            [this](const std::vector<EmergencyStop>& stops) { stops_ = stops; }});
    desk_->set_robots(robots());
  }
  static std::vector<TeleopRobot> robots() {
    TeleopRobot trainee;
    trainee.driven = {"trainee", channel::teleop, channel::joint_cmd};
    trainee.vx = 1.0, trainee.vy = 0, trainee.wz = 2.0;
    trainee.joints = {{"arm", "revolute", -1, 1, 0.5}};
    TeleopRobot agent;
    agent.driven = {"robot_2", agent_teleop, ""};
    return {trainee, agent};
  }
  std::shared_ptr<StandInClient> open(const std::string& name, Role role = Role::trainee) {
    auto client = StandInClient::make(++clients_, name, role);
    handler_.opened(client);
    return client;
  }
  void say(StandInClient& page, const std::string& text) { handler_.received(page, text, false); }
  void close(StandInClient& page) { handler_.closed(page); }
  /// The page's clock runs with ours, `left_before` s ahead of the arrival.
  void twist(StandInClient& page, double vx, double wz = 0, double left_before = 0) {
    char text[160];
    std::snprintf(text, sizeof text, R"({"type":"twist","seq":%llu,"at_ms":%.3f,"vx":%g,"vy":0,"wz":%g})",
                  static_cast<unsigned long long>(++sequence_),
                  (Duration{now_.ns}.seconds() - left_before) * 1e3, vx, wz);
    say(page, text);
  }
  /// Drives `robot`, its dead-man let go.
  void drive(StandInClient& page, const std::string& robot = "trainee") {
    say(page, R"({"type":"drive","robot":")" + robot + "\"}");
    say(page, R"({"type":"release"})");
    heard();
  }
  void pass(double s) {
    for (const WallTime end = now_ + seconds(s); now_ < end;) {
      now_ = std::min(end, now_ + milliseconds(20));
      desk_->turn();
    }
  }
  /// What went out since the last call, by channel; of twists vx.
  std::map<std::string, std::vector<double>> heard() {
    std::map<std::string, std::vector<double>> all;
    Message message;
    while (true) {
      const auto received = server_->receive(message, Duration{0});
      if (!received.ok() || !*received) return all;
      TwistCommand command;
      if (message.channel.ends_with("TELEOP")) {
        EXPECT_TRUE(decode(message.channel, message.payload, command).ok());
        all[message.channel].push_back(command.twist.vx);
        last_ = command.twist;
      } else if (message.channel == channel::joint_cmd) {
        Joints joints;
        EXPECT_TRUE(decode(message.channel, message.payload, joints).ok());
        all[message.channel].push_back(joints.velocities.at(0));
      } else if (message.channel == channel::mr_agent_cmd) {
        AgentCommand order;
        EXPECT_TRUE(decode(message.channel, message.payload, order).ok());
        orders_.push_back(order);
      } else {
        OperatorWord word;
        EXPECT_TRUE(decode(message.channel, message.payload, word).ok());
        words_.push_back(word);
      }
    }
  }
  static bool moves(const std::vector<double>& speeds) {
    return std::any_of(speeds.begin(), speeds.end(), [](double v) { return v != 0; });
  }

  MemoryBusHub hub_;
  std::unique_ptr<Bus> desk_bus_, server_;
  WallTime now_{1'000'000'000};
  std::vector<std::string> audited_;
  std::vector<EmergencyStop> stops_;
  std::vector<OperatorWord> words_;
  std::vector<AgentCommand> orders_;
  Twist2 last_;
  std::uint64_t clients_ = 0, sequence_ = 0;
  std::unique_ptr<TeleopDesk> desk_;
  SocketHandler handler_{
      [this](std::shared_ptr<WebClient> c) { desk_->socket().opened(c); },
      [this](WebClient& c, std::string_view b, bool is) { desk_->socket().received(c, b, is); },
      [this](WebClient& c) { desk_->socket().closed(c); }};
};

TEST_F(TeleopDeskTest, SendsWhatThePageAsksForTheRobotItDrives) {
  auto page = open("anna");
  EXPECT_EQ(page->texts(R"("type":"robots")").size(), 1U);
  EXPECT_NE(page->texts()[0].find(R"("name":"arm")"), std::string::npos);
  twist(*page, 0.5);
  EXPECT_TRUE(heard().empty()) << "it drives none yet";
  drive(*page);
  twist(*page, 0.5);
  EXPECT_EQ(heard()[channel::teleop], std::vector<double>{0.5});
  EXPECT_EQ(page->texts(R"("type":"sent")").size(), 1U);
  EXPECT_EQ(words_.front().robot, "trainee");
  EXPECT_EQ(words_.front().name, operator_name({"anna", Role::trainee}));
  EXPECT_EQ(words_.front().name.find("anna"), std::string::npos) << "nothing personal goes to the bus";
  EXPECT_EQ(audited_, std::vector<std::string>{"anna drives trainee"});
}

TEST_F(TeleopDeskTest, ScalesAsAWholeToWhatTheRobotMay) {
  auto page = open("anna");
  drive(*page);
  twist(*page, 4, 2);
  heard();
  EXPECT_DOUBLE_EQ(last_.vx, 1);
  EXPECT_DOUBLE_EQ(last_.wz, 0.5);
  twist(*page, 0.1, 1e300);
  EXPECT_NE(page->texts("refused").back().find("wz"), std::string::npos);
}

TEST_F(TeleopDeskTest, MovesNothingBeforeTheDeadManWasLetGo) {
  auto page = open("anna");
  say(*page, R"({"type":"drive","robot":"trainee"})");
  heard();
  twist(*page, 0.5);
  EXPECT_FALSE(moves(heard()[channel::teleop])) << "a key that was held already";
  EXPECT_NE(page->texts("refused").back().find(R"("rearm":true)"), std::string::npos);
  say(*page, R"({"type":"release"})");
  twist(*page, 0.5);
  EXPECT_TRUE(moves(heard()[channel::teleop]));
}

TEST_F(TeleopDeskTest, StopsAfterSilenceAndDoesNotStartAgainByItself) {
  auto page = open("anna");
  drive(*page);
  twist(*page, 0.5);
  heard();
  pass(0.28);
  EXPECT_EQ(heard().count(channel::teleop), 0U);
  pass(0.1);
  const auto stopped = heard()[channel::teleop];
  ASSERT_FALSE(stopped.empty());
  EXPECT_FALSE(moves(stopped));
  EXPECT_NE(page->texts("refused").back().find("let go and press again"), std::string::npos);
  twist(*page, 0.5);
  EXPECT_FALSE(moves(heard()[channel::teleop]));
  say(*page, R"({"type":"release"})");
  twist(*page, 0.5);
  EXPECT_TRUE(moves(heard()[channel::teleop]));
}

TEST_F(TeleopDeskTest, RepeatsTheStopOfALetGoDeadMan) {
  auto page = open("anna");
  drive(*page);
  twist(*page, 0.5);
  heard();
  say(*page, R"({"type":"release"})");
  pass(1);
  const auto stops = heard()[channel::teleop];
  EXPECT_GE(stops.size(), 4U);
  EXPECT_LE(stops.size(), 9U) << "and then it is silent";
  EXPECT_FALSE(moves(stops));
}

TEST_F(TeleopDeskTest, NeverReplaysWhatComesLate) {
  auto page = open("anna");
  drive(*page);
  for (int i = 0; i < 10; ++i) {
    twist(*page, 0.5);
    pass(0.05);
  }
  heard();
  // The link hangs for a second; what the page said meanwhile comes at once.
  const WallTime hung = now_;
  pass(1);
  EXPECT_FALSE(moves(heard()[channel::teleop]));
  for (double ago = 1; ago > 0.26; ago -= 0.05) twist(*page, 0.5, 0, (now_ - hung).seconds() - (1 - ago));
  EXPECT_FALSE(moves(heard()[channel::teleop]));
  twist(*page, 0.5);
  EXPECT_FALSE(moves(heard()[channel::teleop])) << "held through the hang: must be let go first";
}

TEST_F(TeleopDeskTest, StopsAtOneLateCommandAmongPunctualOnes) {
  auto page = open("anna");
  drive(*page);
  twist(*page, 0.5);
  heard();
  twist(*page, 0.5, 0, 0.3);
  const auto speeds = heard()[channel::teleop];
  ASSERT_FALSE(speeds.empty());
  EXPECT_FALSE(moves(speeds));
}

TEST_F(TeleopDeskTest, BelievesAPagesClockThatDrifts) {
  auto page = open("anna");
  drive(*page);
  for (int i = 0; i < 5000; ++i) {  // 20 minutes, in which the page's clock loses 0.4 s
    twist(*page, 0.5, 0, 0.25 * i * 300e-6);
    now_ = now_ + milliseconds(250);
    desk_->turn();
    const auto speeds = heard()[channel::teleop];
    ASSERT_EQ(speeds, std::vector<double>{0.5}) << "after " << 0.25 * i << " s";
  }
}

TEST(DeadManGate, KnowsFromEchoesThatALinkHasBecomeSlow) {
  PageClock clock;
  DeadManGate gate;
  const char* why = nullptr;
  gate.release();
  clock.heard(WallTime{}, {});
  for (int i = 1; i < 200; ++i) clock.age(seconds(i - 1.2), WallTime{} + seconds(i));
  EXPECT_FALSE(gate.pass({1, seconds(200 - 1.2)}, clock, WallTime{} + seconds(200), why));
  ASSERT_NE(why, nullptr) << "all of the last minutes took as long: only the echo tells";
  gate.release();
  EXPECT_TRUE(gate.pass({2, seconds(200 - 0.9)}, clock, WallTime{} + seconds(200), why));
}

TEST_F(TeleopDeskTest, LeavesOutWhatIsOutOfOrder) {
  auto page = open("anna");
  drive(*page);
  twist(*page, 0.5);
  heard();
  say(*page, R"({"type":"twist","seq":1,"at_ms":1000,"vx":0.9,"vy":0,"wz":0})");
  EXPECT_TRUE(heard().empty());
}

TEST_F(TeleopDeskTest, StopsAtAMessageThatCannotBeRead) {
  for (const char* bad : {"",
                          "x",
                          "[]",
                          "null",
                          R"({"type":"twist"})",
                          R"({"type":"fly"})",
                          R"({"type":7})",
                          R"({"type":"twist","seq":1e9,"at_ms":1,"vx":NaN,"vy":0,"wz":0})",
                          R"({"type":"twist","seq":1e9,"at_ms":1,"vx":1e999,"vy":0,"wz":0})",
                          R"({"type":"twist","seq":1e9,"at_ms":1,"vx":null,"vy":0,"wz":0})",
                          R"({"type":"twist","seq":1e9,"at_ms":1,"vx":"1","vy":0,"wz":0})",
                          R"({"type":"twist","seq":-1,"at_ms":1,"vx":1,"vy":0,"wz":0})",
                          R"({"type":"twist","seq":1.5,"at_ms":1,"vx":1,"vy":0,"wz":0})",
                          R"({"type":"twist","seq":1e9,"at_ms":1e300,"vx":1,"vy":0,"wz":0})",
                          R"({"type":"twist","seq":1e9,"at_ms":1,"vx":1,"vy":0,"wz":0,"more":1})",
                          R"({"type":"joints","seq":1e9,"at_ms":1,"names":["arm"],"velocities":[]})",
                          R"({"type":"joints","seq":1e9,"at_ms":1,"names":"arm","velocities":[1]})",
                          R"({"type":"joints","seq":1e9,"at_ms":1,"names":[1],"velocities":[1]})",
                          R"({"type":"ping","at_ms":1,"heard_us":1})",
                          R"({"type":"drive","robot":["trainee"]})"}) {
    auto page = open("anna");
    drive(*page);
    twist(*page, 0.5);
    heard();
    say(*page, bad);
    const auto speeds = heard()[channel::teleop];
    ASSERT_FALSE(speeds.empty()) << bad;
    EXPECT_FALSE(moves(speeds)) << bad;
    EXPECT_NE(page->texts("refused").back().find(R"("rearm":true)"), std::string::npos) << bad;
    close(*page);
    heard();
  }
}

TEST_F(TeleopDeskTest, ClosesAPageThatOnlySaysWhatCannotBeReadOrTooMuch) {
  auto page = open("anna");
  drive(*page);
  for (int i = 0; i < 20; ++i) handler_.received(*page, std::string(8, '\0'), true);
  EXPECT_EQ(page->closed_with, 1008);
  EXPECT_TRUE(desk_->driving().empty());
  auto other = open("bert");
  drive(*other);
  for (int i = 0; i < 400; ++i) twist(*other, 0.5);
  EXPECT_EQ(other->closed_with, 1008);
  EXPECT_EQ(heard()[channel::teleop].back(), 0);
}

TEST_F(TeleopDeskTest, LetsOneOperatorDriveARobot) {
  auto anna = open("anna"), bert = open("bert");
  drive(*anna);
  twist(*anna, 0.5);
  heard();
  drive(*bert);
  EXPECT_NE(bert->texts("refused").back().find("'anna'"), std::string::npos);
  twist(*bert, 0.9);
  EXPECT_EQ(heard().count(channel::teleop), 0U);
  twist(*anna, 0.5);
  EXPECT_TRUE(moves(heard()[channel::teleop])) << "the one that drives is not disturbed";
  say(*bert, R"({"type":"drive","robot":"robot_2"})");
  say(*bert, R"({"type":"release"})");
  twist(*bert, 0.3);
  EXPECT_TRUE(moves(heard()[agent_teleop]));
  EXPECT_EQ(desk_->driving().size(), 2U);
}

TEST_F(TeleopDeskTest, LetsAnInstructorTakeOverAfterAStop) {
  auto anna = open("anna");
  auto ines = open("ines", Role::instructor);
  drive(*anna);
  twist(*anna, 0.5);
  heard();
  say(*ines, R"({"type":"drive","robot":"trainee"})");
  EXPECT_EQ(heard()[channel::teleop].back(), 0);
  EXPECT_NE(anna->texts("driven").back().find(R"("by":"ines")"), std::string::npos);
  twist(*anna, 0.5);
  EXPECT_EQ(heard().count(channel::teleop), 0U);
  drive(*anna);
  EXPECT_NE(anna->texts("refused").back().find("'ines'"), std::string::npos);
}

TEST_F(TeleopDeskTest, DrivesFromTheNewerOfTwoPagesOfOneAccount) {
  auto old = open("anna"), newer = open("anna");
  drive(*old);
  twist(*old, 0.5);
  heard();
  say(*newer, R"({"type":"drive","robot":"robot_2"})");
  EXPECT_FALSE(moves(heard()[channel::teleop]));
  EXPECT_NE(old->texts("refused").back().find("another page"), std::string::npos);
  twist(*old, 0.5);
  EXPECT_EQ(heard().count(channel::teleop), 0U);
  EXPECT_EQ(desk_->driving().size(), 1U);
}

TEST_F(TeleopDeskTest, RefusesARobotThatAnotherConsoleDrives) {
  OperatorWord word;
  word.name = "joystick_1";
  word.robot = "trainee";
  word.text = "joystick";
  desk_->hear(word);
  auto page = open("anna");
  drive(*page);
  EXPECT_NE(page->texts("refused").back().find("joystick_1"), std::string::npos);
  pass(1.1);
  drive(*page);
  EXPECT_EQ(desk_->driving().size(), 1U) << "silent for a second: it is lost";
}

TEST_F(TeleopDeskTest, StopsWhenTheConnectionIsLost) {
  auto page = open("anna");
  drive(*page);
  twist(*page, 0.5);
  heard();
  close(*page);
  EXPECT_EQ(heard()[channel::teleop].back(), 0);
  EXPECT_EQ(words_.back().state, OperatorWord::State::lost);
  twist(*page, 0.5);
  EXPECT_TRUE(heard().empty()) << "what comes of a closed page is nothing";
}

TEST_F(TeleopDeskTest, LosesAPageThatIsSilentThoughItIsOpen) {
  auto page = open("anna");
  drive(*page);
  for (int i = 0; i < 10; ++i) {
    say(*page, R"({"type":"ping","at_ms":1})");
    pass(1);
  }
  EXPECT_EQ(desk_->driving().size(), 1U);
  EXPECT_EQ(page->texts("pong").size(), 10U);
  pass(1.1);
  EXPECT_TRUE(desk_->driving().empty());
  heard();
  EXPECT_EQ(words_.back().state, OperatorWord::State::lost);
}

TEST_F(TeleopDeskTest, HoldsAnEmergencyStopUntilItIsReset) {
  auto anna = open("anna"), bert = open("bert");
  drive(*anna);
  twist(*anna, 0.5);
  heard();
  say(*bert, R"({"type":"stop"})");
  auto out = heard();
  EXPECT_EQ(out[channel::teleop].back(), 0) << "all, as he drives none";
  EXPECT_EQ(out[agent_teleop].back(), 0);
  ASSERT_EQ(stops_.size(), 2U);
  EXPECT_EQ(stops_[0].by, "bert");
  EXPECT_NE(anna->texts("estop").back().find(R"("on":true)"), std::string::npos);
  say(*anna, R"({"type":"release"})");
  twist(*anna, 0.5);
  pass(1);
  out = heard();
  EXPECT_GE(out[channel::teleop].size(), 9U) << "said again and again";
  EXPECT_FALSE(moves(out[channel::teleop]));
  EXPECT_GE(orders_.size(), 18U) << "the server is told until it answers";
  for (const AgentCommand& order : orders_) {
    EXPECT_EQ(order.action, AgentCommand::Action::freeze);
    Event answer;
    answer.kind = EventKind::command_accepted;
    answer.request = order.request;
    desk_->hear(answer);
  }
  pass(0.5);
  out = heard();
  EXPECT_EQ(out.count(channel::teleop), 0U) << "the server holds it now";
  EXPECT_TRUE(desk_->stop("", "ines").ok()) << "twice does no harm";
  EXPECT_EQ(desk_->stops()[0].by, "bert");
  EXPECT_FALSE(desk_->reset("robot_7", "ines").ok());
  ASSERT_TRUE(desk_->reset("trainee", "ines").ok());
  heard();
  EXPECT_EQ(orders_.back().action, AgentCommand::Action::unfreeze);
  EXPECT_EQ(orders_.back().agent.name, "trainee");
  pass(5);
  heard();
  EXPECT_EQ(orders_.back().action, AgentCommand::Action::unfreeze) << "and robot_2 stays stopped";
  say(*anna, R"({"type":"drive","robot":"trainee"})");
  twist(*anna, 0.5);
  EXPECT_FALSE(moves(heard()[channel::teleop])) << "a key that was held all the while";
  say(*anna, R"({"type":"release"})");
  twist(*anna, 0.5);
  EXPECT_TRUE(moves(heard()[channel::teleop]));
  EXPECT_EQ(stops_.size(), 1U);
  EXPECT_NE(std::find(audited_.begin(), audited_.end(), "ines resets the emergency stop of trainee"),
            audited_.end());
}

TEST_F(TeleopDeskTest, KeepsAnEmergencyStopOfARobotThatWentAndCameBack) {
  ASSERT_TRUE(desk_->stop("trainee", "anna").ok());
  desk_->set_robots({robots()[1]});
  desk_->set_robots(robots());
  auto page = open("anna");
  EXPECT_EQ(page->texts("estop").size(), 1U);
  drive(*page);
  twist(*page, 0.5);
  EXPECT_FALSE(moves(heard()[channel::teleop]));
  EXPECT_FALSE(desk_->stop("robot_9", "anna").ok());
}

TEST_F(TeleopDeskTest, MovesJointsWithinTheirSpeedAndStopsThem) {
  auto page = open("anna");
  drive(*page);
  const auto joint = [&](const char* name, double speed) {
    char text[160];
    std::snprintf(
        text, sizeof text, R"({"type":"joints","seq":%llu,"at_ms":%.3f,"names":["%s"],"velocities":[%g]})",
        static_cast<unsigned long long>(++sequence_), Duration{now_.ns}.seconds() * 1e3, name, speed);
    say(*page, text);
  };
  joint("arm", 3);
  EXPECT_EQ(heard()[channel::joint_cmd], std::vector<double>{0.5});
  joint("leg", 1);
  EXPECT_NE(page->texts("refused").back().find("no joint 'leg'"), std::string::npos);
  pass(0.35);
  EXPECT_EQ(heard()[channel::joint_cmd].back(), 0) << "silent: stopped";
  joint("arm", 0.2);
  EXPECT_FALSE(moves(heard()[channel::joint_cmd]));
}

TEST_F(TeleopDeskTest, LetsGoOfARobotThatIsGone) {
  auto page = open("anna");
  drive(*page, "robot_2");
  twist(*page, 0.5);
  heard();
  desk_->set_robots({robots()[0]});
  EXPECT_EQ(heard()[agent_teleop].back(), 0);
  EXPECT_TRUE(desk_->driving().empty());
  twist(*page, 0.5);
  EXPECT_TRUE(heard().empty());
}

/// A link that loses: what is lost comes again after a while, and all behind it waits for it, as in TCP.
class LossyWay {
 public:
  explicit LossyWay(double loss) : loss_(loss) {}
  /// When what leaves at `t` s arrives.
  double arrival(double t) {
    double at = t + 0.002;
    for (double again = 0.2; next() < loss_; again *= 2) at += again;
    return last_ = std::max(last_, at);
  }

 private:
  double next() {
    state_ = state_ * 6364136223846793005U + 1442695040888963407U;
    return static_cast<double>(state_ >> 11) * 0x1p-53;
  }
  double loss_, last_ = 0;
  std::uint64_t state_ = 1;
};

/// A key is held for a minute, pressed anew whenever the page is told to.
TEST_F(TeleopDeskTest, StopsOnALossyLinkRatherThanReplayingOldCommands) {
  for (const double loss : {0.02, 0.1}) {
    auto page = open("anna");
    drive(*page);
    LossyWay way(loss);
    struct OnItsWay {
      double arrives, left;
    };
    std::deque<OnItsWay> on_their_way;
    const WallTime begun = now_;
    double moving_since_left = -1, longest = 0;
    int moved = 0, stopped = 0;
    for (int ms = 0; ms < 60'000; ms += 10) {
      const double t = ms * 1e-3;
      now_ = begun + seconds(t);
      if (ms % 50 == 0) on_their_way.push_back({way.arrival(t), t});
      for (; !on_their_way.empty() && on_their_way.front().arrives <= t; on_their_way.pop_front()) {
        twist(*page, 0.5, 0, t - on_their_way.front().left);
        const std::vector<double> sent = heard()[channel::teleop];
        for (const double speed : sent) {
          if (speed == 0) continue;
          ++moved;
          moving_since_left = t;
          EXPECT_LE(t - on_their_way.front().left, 0.255) << "at " << t;
        }
      }
      desk_->turn();
      const std::vector<double> stops = heard()[channel::teleop];
      stopped += static_cast<int>(std::count(stops.begin(), stops.end(), 0.0));
      if (moving_since_left >= 0) longest = std::max(longest, t - moving_since_left);
      const auto refused = page->texts(R"("rearm":true)");
      if (!refused.empty()) {
        moving_since_left = -1;
        page->sent.clear();
        say(*page, R"({"type":"release"})");
      }
    }
    EXPECT_LE(longest, 0.311) << "no command is older than the silence that stops";
    EXPECT_GT(moved, 600) << "and it drives on, at a loss of " << loss;
    EXPECT_GT(stopped, 0);
    close(*page);
    heard();
  }
}

TEST_F(TeleopDeskTest, KeepsWhatAPageMakesUpWithinWhatTheRobotMay) {
  const std::string model = R"({"type":"twist","seq":5,"at_ms":1000,"vx":0.5,"vy":0.1,"wz":-0.2})";
  std::uint64_t random = 7;
  int moved = 0;
  for (int i = 0; i < 1000; ++i) {
    auto page = open("anna");
    drive(*page);
    std::string text = model;
    for (int change = i % 4; change > 0; --change) {
      random = random * 6364136223846793005U + 1442695040888963407U;
      text[(random >> 33) % text.size()] = static_cast<char>(random >> 24);
    }
    say(*page, text);
    moved += moves(heard()[channel::teleop]);
    EXPECT_LE(std::abs(last_.vx), 1.0) << text;
    EXPECT_LE(std::abs(last_.wz), 2.0) << text;
    EXPECT_EQ(last_.vy, 0) << text;
    close(*page);
    heard();
  }
  EXPECT_GE(moved, 250) << "those that were left as they are";
}

}  // namespace
}  // namespace parhelion
