#include "server/runtime/outbox.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <csignal>
#include <thread>

#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::runtime {
namespace {

tick::Outputs::Entry entry(const std::string& channel, std::uint8_t byte) { return {channel, {byte, byte}}; }

std::vector<Message> read_all(const std::string& path) {
  auto reader = LogReader::open(path);
  EXPECT_TRUE(reader.ok());
  std::vector<Message> all;
  while (true) {
    auto next = reader->next();
    if (!next.ok() || !*next) break;
    all.push_back(**next);
  }
  return all;
}

TEST(Outbox, OutboxHasWrittenBeforeItPublishes) {
  test::TemporaryFolder folder;
  MemoryBusHub hub;
  auto server = hub.connect(), listener = hub.connect();
  ASSERT_TRUE(listener->subscribe(".*", 100).ok());
  Outbox outbox(server.get(), *LogWriter::create(folder / "s.lcm", false));
  const Message input{"SCAN", ArrivalTime::from_utime(5), {1}};
  tick::Outputs::Entry outputs[] = {entry("MR_SCAN", 2), entry("MR_EVENTS", 3)};
  outputs[0].sent = true;
  outbox.send(&input, outputs, input.arrival);
  Message incoming;
  ASSERT_TRUE(*listener->receive(incoming, seconds(5)));
  EXPECT_EQ(incoming.channel, "MR_EVENTS") << "MR_SCAN had gone out before";
  const auto log = read_all(folder / "s.lcm");
  ASSERT_EQ(log.size(), 3U);
  EXPECT_EQ(log[0].channel, "SCAN");
  EXPECT_EQ(log[1].channel, "MR_SCAN");
  EXPECT_EQ(log[2].channel, "MR_EVENTS");
}

TEST(Outbox, OutboxWritesAScanAndItsNoteTogether) {
  test::TemporaryFolder folder;
  Outbox outbox(nullptr, *LogWriter::create(folder / "s.lcm", false));
  const Message input{"SCAN", ArrivalTime::from_utime(5), {1}};
  const Message note{"LOOP", ArrivalTime::from_utime(6), {9}};
  const tick::Outputs::Entry outputs[] = {entry("MR_SCAN", 2)};
  outbox.send(&input, outputs, input.arrival, &note);
  outbox.send(&input, outputs, input.arrival);
  const auto log = read_all(folder / "s.lcm");
  ASSERT_EQ(log.size(), 5U);
  EXPECT_EQ(log[1].channel, "MR_SCAN");
  EXPECT_EQ(log[2].channel, "LOOP");
  EXPECT_EQ(log[2].arrival, note.arrival);
  EXPECT_EQ(log[2].payload, note.payload);
  EXPECT_FALSE(outbox.hashes().contains("LOOP")) << "an input";
  EXPECT_EQ(log[4].channel, "MR_SCAN");
}

/// A bus on which sending on the channel `slow` blocks until it is released.
class SlowBus : public Bus {
 public:
  Status publish(std::string_view channel, std::span<const std::uint8_t>) override {
    if (channel == "SLOW") {
      entered = true;
      while (!released) std::this_thread::yield();
    }
    return {};
  }
  Status subscribe(const std::string&, int) override { return {}; }
  Result<bool> receive(Message&, Duration) override { return false; }
  std::uint64_t dropped() const override { return 0; }
  std::atomic<bool> entered = false, released = false;
};

TEST(Outbox, OutboxLetsTheGuardPublishDuringABlockedSend) {
  SlowBus bus;
  Outbox outbox(&bus, std::nullopt);
  std::thread loop([&outbox] {
    const tick::Outputs::Entry slow = entry("SLOW", 1);
    outbox.send(nullptr, {&slow, 1}, ArrivalTime::from_utime(1));
  });
  while (!bus.entered) std::this_thread::yield();
  const std::uint8_t raw[] = {1};
  outbox.publish_now("MR_SCAN", raw);  // must return, or this test never ends
  bus.released = true;
  loop.join();
}

TEST(Outbox, OutboxKeepsPublishingOnAFullDisk) {
  test::TemporaryFolder folder;
  MemoryBusHub hub;
  auto server = hub.connect(), listener = hub.connect();
  ASSERT_TRUE(listener->subscribe(".*", 1000).ok());
  Outbox outbox(server.get(), *LogWriter::create(folder / "s.lcm", false));
  const auto before = std::signal(SIGXFSZ, SIG_IGN);
  rlimit old{};
  getrlimit(RLIMIT_FSIZE, &old);
  const rlimit small{2000, old.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  std::size_t acknowledged = 0;
  for (int i = 0; i < 100; ++i) {
    const Message command{"MR_SPAWN", ArrivalTime::from_utime(10 + i), {static_cast<std::uint8_t>(i)}};
    if (outbox.write_input(command)) ++acknowledged;
    const tick::Outputs::Entry scan = entry("MR_SCAN", static_cast<std::uint8_t>(i));
    outbox.send(nullptr, {&scan, 1}, command.arrival);
  }
  setrlimit(RLIMIT_FSIZE, &old);
  std::signal(SIGXFSZ, before);
  EXPECT_FALSE(outbox.complete());
  EXPECT_NE(outbox.log_error().find("s.lcm"), std::string::npos) << outbox.log_error();
  EXPECT_LT(acknowledged, 100U);
  Message incoming;
  int scans = 0;
  while (*listener->receive(incoming, milliseconds(0))) scans += incoming.channel == "MR_SCAN" ? 1 : 0;
  EXPECT_EQ(scans, 100) << "scans go on";
  std::size_t kept = 0;
  for (const Message& event : read_all(folder / "s.lcm")) kept += event.channel == "MR_SPAWN" ? 1 : 0;
  EXPECT_EQ(kept, acknowledged) << "what was acknowledged stays, whole";
}

TEST(Outbox, OutboxTakesOutputsFromSeveralThreads) {
  test::TemporaryFolder folder;
  Outbox outbox(nullptr, *LogWriter::create(folder / "s.lcm", false));
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&outbox, t] {
      const tick::Outputs::Entry mine = entry("CHANNEL_" + std::to_string(t), static_cast<std::uint8_t>(t));
      for (int i = 0; i < 200; ++i) outbox.send(nullptr, {&mine, 1}, ArrivalTime::from_utime(i));
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(read_all(folder / "s.lcm").size(), 800U);
  EXPECT_EQ(outbox.hashes().size(), 4U);
}

}  // namespace
}  // namespace parhelion::runtime
