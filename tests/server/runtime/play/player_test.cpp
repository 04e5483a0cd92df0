// A recording plays in real time, and its state at a position does not depend on how it was reached.
#include "server/runtime/play/player.hpp"

#include <functional>
#include <map>

#include "server/runtime/play/play_times.hpp"
#include "tests/server/runtime/play/random_session.hpp"

namespace parhelion::runtime {
namespace {

/// A receiver's state: the newest message of each channel, and all events and commands.
struct Listener {
  std::map<std::string, std::vector<std::uint8_t>> newest;
  std::vector<std::vector<std::uint8_t>> events, commands;
  std::size_t received = 0;

  void take(const Message& message) {
    ++received;
    if (message.channel == channel::kMrSession) *this = {{}, {}, {}, received};
    Event event;
    if (message.channel == channel::kMrEvents) {
      ASSERT_TRUE(decode(message.channel, message.payload, event).ok());
      if (event.kind != EventKind::contact_continues) events.push_back(message.payload);
    } else if (message.channel == channel::kMrFreeze || message.channel == channel::kMrSpawn) {
      commands.push_back(message.payload);
    } else {
      newest[message.channel] = message.payload;
    }
  }
  bool knows_the_same_as(const Listener& other) const {
    return newest == other.newest && events == other.events && commands == other.commands;
  }
};

class PlayerTest : public ::testing::Test {
 protected:
  void write(std::uint64_t seed, int messages = 600) { test::write_random_session(path_, seed, messages); }
  Recording recording() {
    auto opened = Recording::open(path_);
    EXPECT_TRUE(opened.ok()) << (opened ? "" : opened.error().message);
    return std::move(opened).value();
  }
  std::unique_ptr<Player> player(const PlayOptions& options, Listener& listener) {
    return std::make_unique<Player>(recording(), options,
                                    [&listener](const Message& message) { listener.take(message); });
  }
  /// For `duration` s of the wall clock.
  void run(Player& player, double duration) {
    const WallTime end = now_ + seconds(duration);
    while (true) {
      const auto idle = player.turn(now_);
      ASSERT_TRUE(idle.ok()) << idle.error().message;
      if (now_ == end) return;
      now_ = std::min(end, now_ + std::max(*idle, milliseconds(1)));
    }
  }

  const test::PlayFolder folder_;
  const std::string path_ = folder_ / "session.lcm";
  WallTime now_{5'000'000'000};
};

TEST_F(PlayerTest, SeekingEqualsPlayingToTheSamePosition) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    write(seed);
    Listener seeking;
    const auto jumps = player({}, seeking);
    const double duration = jumps->recording().duration();
    std::mt19937_64 random(seed);
    for (int i = 0; i < 12; ++i) {
      const double t = duration * static_cast<double>(random() % 1001) / 1000;
      ASSERT_TRUE(jumps->seek(t).ok());
      run(*jumps, 0);
      Listener playing;
      const auto plays = player({}, playing);
      run(*plays, t);
      EXPECT_TRUE(seeking.knows_the_same_as(playing)) << "seed " << seed << ", to " << t << " s";
      if (i % 3 == 0) run(*jumps, 0.1 * duration);  // continues normally from there
    }
  }
}

TEST_F(PlayerTest, EachRecordedMessageIsSentOnceAtItsTime) {
  write(3);
  const Recording all = recording();
  std::vector<std::pair<double, std::vector<std::uint8_t>>> sent;
  const WallTime start = now_;
  Player player(recording(), {.rate = 2}, [&](const Message& message) {
    sent.emplace_back((now_ - start).seconds(), message.payload);
  });
  run(player, all.duration());
  ASSERT_EQ(sent.size(), all.size());
  Message message;
  for (std::size_t i = 0; i < all.size(); ++i) {
    ASSERT_TRUE(all.read(i, message).ok());
    EXPECT_EQ(sent[i].second, message.payload);
    EXPECT_GE(sent[i].first, all.t(i) / 2 - 1e-6);
    EXPECT_LE(sent[i].first, all.t(i) / 2 + 0.0011);
  }
  EXPECT_TRUE(player.state().ended);
  EXPECT_EQ(player.state().position, all.duration());
}

TEST_F(PlayerTest, WhilePausedItStepsMessageByMessage) {
  write(4);
  Listener listener;
  const auto paused = player({.paused = true}, listener);
  run(*paused, 1);
  EXPECT_EQ(listener.received, 1U);  // MR_SESSION: the state at the start
  EXPECT_EQ(paused->state().position, 0);
  for (std::size_t i = 0; i < 5; ++i) {
    ASSERT_TRUE(paused->step().ok());
    run(*paused, 0.1);
    EXPECT_EQ(listener.received, i + 2);
    EXPECT_EQ(paused->state().position, paused->recording().t(i + 1));
  }
  paused->pause(false);
  EXPECT_FALSE(paused->step().ok());
  run(*paused, paused->recording().duration());
  EXPECT_TRUE(paused->state().ended);
  EXPECT_EQ(listener.received, paused->recording().size());
}

TEST_F(PlayerTest, ItsRateCanBeChangedWhileItPlays) {
  write(5);
  Listener listener;
  const auto plays = player({}, listener);
  run(*plays, 0.5);
  EXPECT_NEAR(plays->state().position, 0.5, 1e-9);
  ASSERT_TRUE(plays->set_rate(0.5).ok());
  run(*plays, 0.5);
  EXPECT_NEAR(plays->state().position, 0.75, 0.051);
  for (const double bad : {0.0, -1.0, 101.0, std::nan("")}) EXPECT_FALSE(plays->set_rate(bad).ok()) << bad;
  EXPECT_FALSE(plays->seek(std::nan("")).ok());
  ASSERT_TRUE(plays->seek(1e9).ok());
  run(*plays, 0.1);
  EXPECT_TRUE(plays->state().ended);
}

TEST_F(PlayerTest, LoopingRestartsRepeatedly) {
  write(6, 50);
  Listener listener;
  const auto loops = player({.loop = true}, listener);
  run(*loops, 3.5 * loops->recording().duration());
  EXPECT_FALSE(loops->state().ended);
  EXPECT_GT(listener.received, 3 * loops->recording().size());
  EXPECT_LT(listener.received, 4 * loops->recording().size() + 1);
}

TEST_F(PlayerTest, AStartOffsetIsASeekBeforeTheFirstMessage) {
  write(7);
  Listener offset, played;
  const auto late = player({.start = 1.5, .paused = true}, offset);
  run(*late, 0);
  const auto whole = player({}, played);
  run(*whole, 1.5);
  EXPECT_TRUE(offset.knows_the_same_as(played));
}

TEST_F(PlayerTest, MarksHaveTheTimesOfImportantEvents) {
  write(8);
  const Recording all = recording();
  std::size_t bad = 0;
  for (const RecordedMark& mark : all.marks()) {
    EXPECT_GE(mark.t, 0);
    EXPECT_LE(mark.t, all.duration());
    bad += mark.bad ? 1 : 0;
    EXPECT_NE(mark.kind, "contact_continues");
  }
  EXPECT_GT(bad, 0U);
  EXPECT_LT(bad, all.marks().size());
}

/// 20 messages, 0.1 s apart; `change` damages their stamps (ns).
std::vector<std::int64_t> stamps(const std::function<void(std::vector<std::int64_t>&)>& change) {
  std::vector<std::int64_t> all;
  for (std::int64_t i = 0; i < 20; ++i) all.push_back(test::kSessionStart.ns + i * 100'000'000);
  change(all);
  return all;
}

constexpr std::int64_t kCentury = 3'155'760'000'000'000'000;  // ns

TEST(PlayTimes, ADamagedStampIsPlayedWithTheMessageBeforeIt) {
  for (const std::int64_t by : {kCentury, -test::kSessionStart.ns, std::int64_t{30'000'000'000}}) {
    for (const std::size_t at : {0U, 1U, 7U, 18U}) {
      const auto played = play_times(stamps([&](auto& all) { all[at] += by; }));
      ASSERT_EQ(played.times.size(), 20U);
      if (at != 0 || by > 0) {
        ASSERT_EQ(played.findings.size(), 1U) << by << " at " << at;
        EXPECT_EQ(played.findings[0].message, at);
        EXPECT_TRUE(played.findings[0].damaged);
      }
      EXPECT_LE(played.times.back().t, 1'900'000'000) << by << " at " << at;
      EXPECT_GE(played.times.back().t, 1'700'000'000) << by << " at " << at;
    }
  }
}

TEST(PlayTimes, ALongGapIsNotWaitedFor) {
  const auto played = play_times(stamps([](auto& all) {
    for (std::size_t i = 10; i < all.size(); ++i) all[i] += kCentury;
  }));
  ASSERT_EQ(played.findings.size(), 1U);
  EXPECT_EQ(played.findings[0].message, 10U);
  EXPECT_FALSE(played.findings[0].damaged);
  EXPECT_EQ(played.times[10].t, played.times[9].t);
  EXPECT_EQ(played.times[19].t, 1'800'000'000);
  EXPECT_EQ(played.times[19].arrival, test::kSessionStart.ns + kCentury + 1'900'000'000);
}

TEST(PlayTimes, UndamagedStampsAreUnchanged) {
  const auto all = stamps([](auto&) {});
  const auto played = play_times(all);
  EXPECT_TRUE(played.findings.empty());
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(played.times[i].arrival, all[i]);
    EXPECT_EQ(played.times[i].t, all[i] - all[0]);
  }
  EXPECT_TRUE(play_times({}).times.empty());
}

TEST_F(PlayerTest, DistinguishesADamagedLogFromNoSessionLog) {
  EXPECT_FALSE(Recording::open(folder_ / "nothing.lcm").ok());
  {
    auto log = LogWriter::create(path_, true);
    const std::uint8_t byte = 1;
    ASSERT_TRUE(log.ok() && log->write("SCAN", test::kSessionStart, {&byte, 1}).ok());
  }
  const auto no_session = Recording::open(path_);
  ASSERT_FALSE(no_session.ok());
  EXPECT_NE(no_session.error().message.find("expected MR_SESSION"), std::string::npos);
  write(9);
  std::filesystem::resize_file(path_, std::filesystem::file_size(path_) - 7);
  const Recording cut = recording();
  EXPECT_GT(cut.skipped_bytes(), 0U);
  EXPECT_EQ(cut.size(), 600U);
}

}  // namespace
}  // namespace parhelion::runtime
