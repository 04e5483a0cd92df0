// Foxglove's own client (tests/browser/foxglove.mjs) opens a session.
#include "server/station/foxglove/foxglove_server.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/server/review/written_session.hpp"
#include "tests/server/station/http/raw_client.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::station {
namespace {

const std::string kBrowserFolder = std::string(PARHELION_SOURCE_DIR) + "/tests/browser";

/// Publishes a log repeatedly until it is destroyed.
class Talker {
 public:
  Talker(const std::string& log, std::unique_ptr<Bus> bus)
      : bus_(std::move(bus)), thread_([this, log](const std::stop_token& stop) {
          while (!stop.stop_requested()) publish_log(log, stop);
        }) {}

 private:
  void publish_log(const std::string& log, const std::stop_token& stop) {
    auto reader = LogReader::open(log);
    ASSERT_TRUE(reader.ok());
    for (auto next = reader->next(); next.ok() && next->has_value() && !stop.stop_requested();
         next = reader->next()) {
      ASSERT_TRUE(bus_->publish((*next)->channel, (*next)->payload).ok());
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
  }

  std::unique_ptr<Bus> bus_;
  std::jthread thread_;
};

class FoxgloveServerTest : public ::testing::Test {
 protected:
  std::unique_ptr<FoxgloveServer> open(std::function<ArrivalTime()> clock = {}) {
    FoxgloveOptions options;
    options.port = 0;
    options.clock = std::move(clock);
    auto server = FoxgloveServer::open(hub_.connect(), session_.configuration(), options);
    EXPECT_TRUE(server.ok()) << (server ? "" : server.error().message);
    return server ? std::move(*server) : nullptr;
  }

  MemoryBusHub hub_;
  test::WrittenSession session_;
};

TEST_F(FoxgloveServerTest, FoxgloveClientReceivesEveryTopicAndItsMessages) {
  if (!std::filesystem::exists(kBrowserFolder + "/node_modules/@foxglove/ws-protocol")) {
    // tools/test has installed it, so its absence is a failure there.
    ASSERT_EQ(std::getenv("PARHELION_BROWSER"), nullptr) << "no packages in " << kBrowserFolder;
    GTEST_SKIP() << "needs `npm ci` in " << kBrowserFolder;
  }
  const test::TemporaryFolder folder;
  session_.seconds = 5;
  session_.picture_width = 64;
  session_.write(folder / "session.lcm");
  const auto server = open();
  ASSERT_NE(server, nullptr);
  const Talker talker(folder / "session.lcm", hub_.connect());
  const auto ran =
      test::run({kBrowserFolder + "/foxglove.mjs", server->address(), "/scan", "/mr_scan", "/virtual_returns",
                 "/mr_camera/image", "/scene", "/names", "/events", "/injection", "/mr_cmd", "/building"},
                folder / "node.txt", "/usr/bin/node");
  EXPECT_EQ(ran.exit, 0) << ran.output;
  EXPECT_NE(ran.output.find("ok  none is refused"), std::string::npos) << ran.output;
}

/// Opcode and time of a binary message; 0 for a text.
struct FrameHeader {
  int opcode = 0;
  std::int64_t time = 0;  ///< ns
};

FrameHeader header_of(const test::RawClient::Frame& frame) {
  const std::size_t at = frame.opcode == 2 && frame.payload[0] == 1 ? 5 : 1;
  if (frame.opcode != 2 || frame.payload.size() < at + 8) return {};
  std::uint64_t time = 0;
  for (std::size_t i = 8; i-- > 0;) time = time << 8U | static_cast<unsigned char>(frame.payload[at + i]);
  return {frame.payload[0], static_cast<std::int64_t>(time)};
}

TEST_F(FoxgloveServerTest, ATimeResetIsSentBeforeItsMessages) {
  const test::TemporaryFolder folder;
  session_.seconds = 1;
  session_.write(folder / "session.lcm");
  auto log = LogReader::open(folder / "session.lcm");
  ASSERT_TRUE(log.ok());
  const auto first = log->next();
  ASSERT_TRUE(first.ok() && first->has_value() && (*first)->channel == channel::kMrSession);

  constexpr std::int64_t late = 900'000'000'000, early = 500'000'000'000;
  std::atomic<std::int64_t> clock = late;
  const auto server = open([&clock] { return ArrivalTime{clock.load()}; });
  ASSERT_NE(server, nullptr);
  test::RawClient client(server->port());
  ASSERT_EQ(client.open_socket("/", "", "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n").status, 101);
  std::uint64_t building = 0;
  for (bool time_received = false; !time_received || building == 0;) {
    const auto frame = client.frame();
    ASSERT_TRUE(frame.has_value());
    if (frame->opcode == 1) {
      const auto message = nlohmann::json::parse(frame->payload);
      if (message["op"] == "serverInfo") {
        EXPECT_EQ(message["capabilities"], nlohmann::json{"time"});
      }
      if (message["op"] != "advertise") continue;
      for (const auto& channel : message["channels"])
        if (channel["topic"] == "/building") building = channel["id"];
    } else {
      const FrameHeader time = header_of(*frame);
      EXPECT_EQ(time.opcode, 2);
      EXPECT_EQ(time.time, late);
      time_received = true;
    }
  }
  client.send_text(R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":)" + std::to_string(building) +
                   "}]}");
  auto frame = client.frame();
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(header_of(*frame).opcode, 1);
  EXPECT_EQ(header_of(*frame).time, late);

  // As in a recording that restarts.
  clock = early;
  ASSERT_TRUE(hub_.connect()->publish((*first)->channel, (*first)->payload).ok());
  std::vector<FrameHeader> all;
  while (all.empty() || all.back().opcode != 1) {
    frame = client.frame();
    ASSERT_TRUE(frame.has_value());
    if (frame->opcode == 2) all.push_back(header_of(*frame));
  }
  ASSERT_GE(all.size(), 2U);
  for (const FrameHeader& each : all) EXPECT_EQ(each.time, early);
}

TEST_F(FoxgloveServerTest, AnOccupiedPortIsReported) {
  const auto first = open();
  ASSERT_NE(first, nullptr);
  FoxgloveOptions options;
  options.port = first->port();
  const auto second = FoxgloveServer::open(hub_.connect(), session_.configuration(), options);
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().message.find(std::to_string(first->port())), std::string::npos)
      << second.error().message;
}

}  // namespace
}  // namespace parhelion::station
