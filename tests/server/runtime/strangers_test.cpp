// A stranger on a bus without keys sends damaged messages on every channel: the robot is answered and stops,
// memory and events stay bounded, and the log replays. With well-formed messages a stranger can drive a robot
// without keys (docs/security.md).
#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <fstream>
#include <limits>
#include <random>
#include <set>

#include "protocols/channel_map.hpp"
#include "tests/long_run.hpp"
#include "tests/protocols/codec_samples.hpp"
#include "tests/server/runtime/loop_fixture.hpp"

namespace parhelion::runtime {
namespace {

/// Channels by the type of their messages: inputs of each kind, then what only the server publishes.
std::vector<std::string> channels_of_type(const std::string& type) {
  static const std::map<std::string, std::vector<std::string>> all{
      {"planar_lidar_t", {"SCAN", "LINES", "MR_SCAN"}},
      {"lidar_t", {"SCAN", "LINES"}},
      {"image_t", {"CAMERA", "DEPTH", "MR_CAMERA", "MR_DEPTH"}},
      {"pose2D_t", {"ODOMETRY"}},
      {"pose_cov_t", {"POSE_COV"}},
      {"pose_t", {"POSE", "REFERENCE_POSE"}},
      {"twist2D_t", {"TELEOP", "MR_AGENT_robot_1_TELEOP", "MR_CMD"}},
      {"mbot_motor_command_t", {"TELEOP"}},
      {"imu_t", {"IMU"}},
      {"mbot_imu_t", {"IMU"}},
      {"joints_t", {"JOINT_STATE", "JOINT_CMD", "MR_AGENT_robot_1_JOINT_CMD", "MR_JOINT_CMD", "BUMPER"}},
      {"agent_spawn_t", {"MR_SPAWN"}},
      {"agent_move_t", {"MR_MOVE"}},
      {"agent_behaviour_t", {"MR_BEHAVIOUR"}},
      {"agent_remove_t", {"MR_REMOVE"}},
      {"agent_freeze_t", {"MR_FREEZE"}},
      {"door_cmd_t", {"MR_DOOR"}},
      {"fault_cmd_t", {"MR_FAULT"}},
      {"camera_rate_t", {"MR_CAMERA_RATE"}},
      {"object_report_t", {"MR_OBJECT_REPORT"}},
      {"script_start_t", {"MR_SCRIPT"}},
      {"training_start_t", {"MR_START"}},
      {"emergency_stop_t", {"MR_EMERGENCY_STOP"}},
      {"operator_t", {"OPERATOR"}},
      {"event_t", {"MR_EVENTS"}},
      {"session_t", {"MR_SESSION"}},
      {"scan_info_t", {"MR_SCAN_INFO"}},
      {"loop_t", {"LOOP"}},
      {"status_t", {"MR_STATUS"}},
      {"model_t", {"MR_MODEL"}},
      {"hazard_reading_t", {"HAZARD"}},
      {"robot_t", {"ROBOT"}},
      {"world_t", {"MR_WORLD"}}};
  const auto known = all.find(type);
  return known == all.end() ? std::vector<std::string>{} : known->second;
}

/// The same messages for the same seed.
class Stranger {
 public:
  explicit Stranger(std::uint64_t seed) : random_(seed) {
    for (const test::Sample& sample : test::samples()) {
      for (const std::string& channel : channels_of_type(sample.type))
        samples_.push_back({channel, {}, sample.bytes});
    }
  }

  std::set<std::string> channels() const {
    std::set<std::string> all;
    for (const Message& each : samples_) all.insert(each.channel);
    return all;
  }

  /// On each channel in turn.
  Message next() {
    Message message = samples_[next_++ % samples_.size()];
    damage(message);
    return message;
  }

  /// A well-formed message with a name of 1 MB.
  static Message long_name(std::size_t i) {
    const std::string name(1'000'000, 'x');
    Message message;
    switch (i % 4) {
      case 0:
        return test::message(channel::kMrSpawn, 0, [&] {
          AgentSpawn spawn;
          spawn.request = 1000 + i;
          spawn.agent = test::agent(name, AgentKind::box, 2, 2);
          return spawn;
        }());
      case 1:
        return test::message(channel::kOperators, 0,
                             OperatorStatus{{}, name, name, OperatorStatus::State::drives, name});
      case 2:
        return test::message(channel::kJointState, 0, Joints{{}, {name}, {0}, {}, {}});
      default:
        return test::message(channel::kMrEmergencyStop, 0,
                             EmergencyStopCommand{.request = 1000 + i, .robot = name, .engaged = false});
    }
  }

 private:
  static constexpr std::size_t kHeader = 8;  // bytes of the type's fingerprint

  std::size_t below(std::size_t n) { return n == 0 ? 0 : random_() % n; }

  void put(std::vector<std::uint8_t>& bytes, std::size_t at, std::uint64_t number, std::size_t width) {
    for (std::size_t i = 0; i < width && at + i < bytes.size(); ++i)
      bytes[at + i] = static_cast<std::uint8_t>(number >> (8 * (width - 1 - i)));
  }
  std::size_t place(const std::vector<std::uint8_t>& bytes) {
    return kHeader + below(bytes.size() - std::min(bytes.size(), kHeader));
  }

  void damage(Message& message) {
    auto& bytes = message.payload;
    using Double = std::numeric_limits<double>;
    constexpr double numbers[] = {Double::quiet_NaN(), Double::infinity(), -Double::infinity(), 1e308, -1e308,
                                  Double::denorm_min()};
    constexpr std::uint64_t counts[] = {0xffffffff, 0x7fffffff, 0x80000000, 0x10000000, 0xffff, 1, 0};
    constexpr std::int64_t stamps[] = {std::numeric_limits<std::int64_t>::max(),
                                       std::numeric_limits<std::int64_t>::min(), -1, 0};
    switch (below(8)) {
      case 0:
        return put(bytes, place(bytes), std::bit_cast<std::uint64_t>(numbers[below(std::size(numbers))]), 8);
      case 1:
        return put(bytes, place(bytes), std::bit_cast<std::uint32_t>(static_cast<float>(numbers[below(3)])),
                   4);
      case 2:
        return put(bytes, kHeader, static_cast<std::uint64_t>(stamps[below(std::size(stamps))]), 8);
      case 3:
        return put(bytes, place(bytes), counts[below(std::size(counts))], 4);
      case 4:
        return put(bytes, 0, random_(), 8);
      case 5:
        return bytes.resize(below(bytes.size()));
      case 6:
        for (std::size_t left = 1 + below(100); left > 0; --left)
          bytes.push_back(static_cast<std::uint8_t>(random_()));
        return;
      default:
        for (std::size_t i = kHeader; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(random_());
    }
  }

  std::mt19937_64 random_;
  std::vector<Message> samples_;
  std::size_t next_ = 0;
};

TEST(Stranger, UsesEveryInputOfTheServer) {
  const std::set<std::string> used = Stranger(1).channels();
  for (const std::string& input : input_channels({"robot_1"})) EXPECT_TRUE(used.contains(input)) << input;
  for (const std::string& output : output_channels({})) EXPECT_TRUE(used.contains(output)) << output;
}

class StrangersTest : public test::LoopTest {
 protected:
  /// What the server publishes: not what the stranger sends on the same channels.
  void note(const Message& message) {
    if (message.sender != server_) return;
    if (message.channel == channel::kMrScan) {
      if (const auto stamp = leading_stamp(message.payload)) ++answers_[stamp->utime()];
    } else if (message.channel == channel::kMrEvents) {
      Event event;
      ASSERT_TRUE(decode(message.channel, message.payload, event).ok());
      events_.push_back(event);
      if (event.request == kStop && event.kind == EventKind::command_accepted) stopped_ = true;
    } else if (message.channel == channel::kMrCmd) {
      TwistCommand command;
      ASSERT_TRUE(decode(message.channel, message.payload, command).ok());
      const bool moves = command.twist.vx != 0 || command.twist.vy != 0 || command.twist.wz != 0;
      ++(stopped_ ? commands_after_stop_ : commands_);
      moved_ = moved_ || (moves && !stopped_);
      moved_after_stop_ = moved_after_stop_ || (moves && stopped_);
    }
  }
  /// What has come, and what comes within `timeout` after it.
  void receive(Duration timeout = {}) {
    Message message;
    while (true) {
      const auto received = robot_->receive(message, timeout);
      if (!received.ok() || !*received) return;
      note(message);
    }
  }
  template <class T>
  void send(const char* channel, const T& item) {
    std::vector<std::uint8_t> payload;
    encode(item, payload);
    ASSERT_TRUE(robot_->publish(channel, payload).ok());
  }
  /// Plays the robot's messages in real time with a trainee who drives; `between` is called before each.
  template <class Between>
  void drive(std::span<const Message> log, Between between) {
    const WallTime begun = steady_now();
    WallTime teleop = begun;
    for (const Message& each : log) {
      const Duration due = each.arrival - log.front().arrival;
      do {
        between(steady_now() - begun);
        receive();
        if (steady_now() < teleop) continue;
        teleop = teleop + milliseconds(50);
        send(channel::kTeleop, TwistCommand{{wall_now().ns}, {0.2, 0, 0}});
      } while (steady_now() - begun < due);
      ASSERT_TRUE(robot_->publish(each.channel, each.payload).ok());
    }
  }
  /// Its reply, or what it has done.
  static bool is_of_a_command(const Event& event) {
    return event.kind == EventKind::command_accepted || event.kind == EventKind::command_refused ||
           event.kind == EventKind::object_reported || event.kind == EventKind::fault_started ||
           event.kind == EventKind::fault_ended;
  }
  static std::uint64_t resident_bytes() {
    std::ifstream file("/proc/self/statm");
    std::uint64_t total = 0, resident = 0;
    file >> total >> resident;
    return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  }

  static constexpr std::uint64_t kStop = 77;
  std::uint64_t server_ = 0;
  std::map<std::int64_t, int> answers_;  // by stamp, us
  std::vector<Event> events_;
  std::size_t commands_ = 0, commands_after_stop_ = 0;
  bool stopped_ = false, moved_ = false, moved_after_stop_ = false;
};

class StrangersFloodTest : public StrangersTest, public testing::WithParamInterface<std::uint64_t> {};

TEST_P(StrangersFloodTest, ARobotIsAnsweredAndStopsUnderAFloodOfDamagedMessages) {
  serve_in_background(test::configuration({test::agent("robot_1", AgentKind::robot, 0, 3)}));
  const auto first = await(channel::kMrSession, 1);
  ASSERT_FALSE(first.empty());
  server_ = first.front().sender;
  const auto log = test::drive(5);
  const auto second = std::find_if(log.begin(), log.end(), [&](const Message& each) {
    return each.arrival - log.front().arrival > seconds(2);
  });
  // The trainee releases the dead-man switch first.
  send(channel::kTeleop, TwistCommand{{wall_now().ns}, {}});
  ASSERT_FALSE(await(channel::kMrCmd, 1).empty());
  drive({log.begin(), second}, [](Duration) {});
  EXPECT_TRUE(moved_) << "before the stranger came";

  constexpr double kPerSecond = 10'000;
  const auto stranger_bus = hub_.connect();
  Stranger stranger(GetParam());
  std::uint64_t sent = 0, sent_commands = 0;
  bool asked_to_stop = false;
  const std::size_t events_before = events_.size();
  drive({second, log.end()}, [&](Duration t) {
    for (; static_cast<double>(sent) < kPerSecond * t.seconds(); ++sent) {
      const Message message = sent % 1000 == 999 ? Stranger::long_name(sent / 1000) : stranger.next();
      sent_commands += command_on(message.channel) ? 1U : 0U;
      ASSERT_TRUE(stranger_bus->publish(message.channel, message.payload).ok());
    }
    if (asked_to_stop || t < seconds(1.5)) return;
    asked_to_stop = true;
    send(channel::kMrEmergencyStop, EmergencyStopCommand{.request = kStop});
  });
  const std::int64_t last = stamps(log, channel::kScan).back();
  const WallTime deadline = steady_now() + seconds(20);
  while (!answers_.contains(last) && steady_now() < deadline) receive(milliseconds(10));
  // Each command has one reply; all that the other 25,000 messages cause is a few dozen events.
  std::size_t of_commands = 0;
  for (std::size_t i = events_before; i < events_.size(); ++i)
    of_commands += is_of_a_command(events_[i]) ? 1U : 0U;
  EXPECT_LE(of_commands, 2 * sent_commands);
  EXPECT_LE(events_.size() - events_before - of_commands, 50U);
  EXPECT_GT(sent, 20'000U);
  for (const std::int64_t stamp : stamps(log, channel::kScan)) EXPECT_EQ(answers_[stamp], 1) << stamp;
  EXPECT_TRUE(stopped_);
  EXPECT_GT(commands_after_stop_, 0U);
  EXPECT_FALSE(moved_after_stop_);
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  expect_same_bytes_again(**report_);
}

INSTANTIATE_TEST_SUITE_P(Seeds, StrangersFloodTest,
                         testing::Range<std::uint64_t>(1, test::long_run() ? 21 : 2));

TEST_F(StrangersTest, MemoryStaysBoundedWhileTheLoopIsBehind) {
  serve_in_background(test::configuration({test::agent("robot_1", AgentKind::robot, 0, 3)}));
  const auto log = test::drive(1);
  play(log, 1.0);
  EXPECT_TRUE(await_scan(log));
  shut_gate();
  const std::uint64_t before = resident_bytes();
  const auto stranger = hub_.connect();
  for (std::size_t i = 0; i < 1600; ++i) {
    const Message message = Stranger::long_name(i);
    ASSERT_TRUE(stranger->publish(message.channel, message.payload).ok());
  }
  // 64 MiB for each of two kinds of inputs, in the queues of the robot and of the session, and the bus's own.
  EXPECT_LT(resident_bytes(), before + 700'000'000) << "of 1.6 GB that were sent";
  send(channel::kMrEmergencyStop, EmergencyStopCommand{.request = kStop});
  open_gate();
  Message message;
  bool accepted = false;
  while (!accepted) {
    const auto received = robot_->receive(message, seconds(20));
    ASSERT_TRUE(received.ok() && *received);
    Event event;
    accepted = message.channel == channel::kMrEvents && decode(message.channel, message.payload, event) &&
               event.request == kStop && event.kind == EventKind::command_accepted;
  }
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  expect_same_bytes_again(**report_);
}

}  // namespace
}  // namespace parhelion::runtime
