// Foxglove's own client (tests/browser/foxglove.mjs) opens a session.
#include "server/hmi/foxglove/foxglove_server.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <thread>

#include "tests/server/review/written_session.hpp"
#include "tests/tools/process.hpp"

namespace parhelion {
namespace {

const std::string browser_folder = std::string(PARHELION_SOURCE_DIR) + "/tests/browser";

/// Says a log again and again, until it goes.
class Talker {
 public:
  Talker(const std::string& log, std::unique_ptr<Bus> bus)
      : bus_(std::move(bus)), thread_([this, log](const std::stop_token& stop) {
          while (!stop.stop_requested()) say(log, stop);
        }) {}

 private:
  void say(const std::string& log, const std::stop_token& stop) {
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
  std::unique_ptr<FoxgloveServer> open(std::uint16_t port = 0) {
    FoxgloveOptions options;
    options.port = port;
    auto server = FoxgloveServer::open(hub_.connect(), session_.configuration(), options);
    EXPECT_TRUE(server.ok()) << (server ? "" : server.error().message);
    return server ? std::move(*server) : nullptr;
  }

  MemoryBusHub hub_;
  test::WrittenSession session_;
};

TEST_F(FoxgloveServerTest, FoxglovesClientIsToldOfEveryTopicAndGetsItsMessages) {
  if (!std::filesystem::exists(browser_folder + "/node_modules/@foxglove/ws-protocol")) {
    // tools/test has installed it: there this is a failure.
    ASSERT_EQ(std::getenv("PARHELION_BROWSER"), nullptr) << "no packages in " << browser_folder;
    GTEST_SKIP() << "needs `npm ci` in " << browser_folder;
  }
  const test::Folder folder;
  session_.seconds = 5;
  session_.picture_width = 64;
  session_.write(folder / "session.lcm");
  const auto server = open();
  ASSERT_NE(server, nullptr);
  const Talker talker(folder / "session.lcm", hub_.connect());
  const auto ran =
      test::run({browser_folder + "/foxglove.mjs", server->address(), "/scan", "/mr_scan", "/virtual_returns",
                 "/mr_camera", "/scene", "/names", "/events", "/injection", "/mr_cmd", "/building"},
                folder / "node.txt", "/usr/bin/node");
  EXPECT_EQ(ran.exit, 0) << ran.output;
  EXPECT_NE(ran.output.find("ok  none is refused"), std::string::npos) << ran.output;
}

TEST_F(FoxgloveServerTest, APortThatIsTakenIsSaid) {
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
}  // namespace parhelion
