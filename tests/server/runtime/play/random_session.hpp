// A random session log of many channels, from a seed.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/scenario.hpp"

namespace parhelion::test {

/// A temporary folder, removed with the object.
class PlayFolder {
 public:
  PlayFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "parhelion-play-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~PlayFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  PlayFolder(const PlayFolder&) = delete;
  PlayFolder& operator=(const PlayFolder&) = delete;
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

inline const ArrivalTime kSessionStart{1'700'000'000'000'000'000};

/// Writes `messages` of them, 5 ms apart on average, some with the same arrival.
inline void write_random_session(const std::string& path, std::uint64_t seed, int messages) {
  auto log = LogWriter::create(path, true);
  ASSERT_TRUE(log.ok());
  std::vector<std::uint8_t> bytes;
  Scenario scenario;
  scenario.name = "random";
  SessionHeader header;
  header.stamp = {kSessionStart.ns};
  header.scenario_yaml = to_yaml(scenario);
  encode(header, bytes);
  ASSERT_TRUE(log->write(channel::kMrSession, kSessionStart, bytes).ok());
  std::mt19937_64 random(seed);
  const auto below = [&random](std::uint64_t n) { return random() % n; };
  ArrivalTime now = kSessionStart;
  for (int i = 0; i < messages; ++i) {
    if (below(5) > 0) now = now + milliseconds(static_cast<std::int64_t>(below(13)));
    switch (below(4)) {
      case 0: {
        Event event;
        event.stamp = simulation_time(now);
        event.subject = "somebody";
        event.kind = static_cast<EventKind>(below(static_cast<std::uint64_t>(kLastEventKind) + 1));
        event.value = i;
        encode(event, bytes);
        ASSERT_TRUE(log->write(channel::kMrEvents, now, bytes).ok());
        break;
      }
      case 1: {
        InstructorCommand command = AgentFreeze{.agent = "agent"};
        if (below(2) == 0) {
          AgentSpawn spawn;
          spawn.agent.name = "agent";
          command = spawn;
        }
        set_request(command, {now.ns}, static_cast<std::uint64_t>(i));
        encode(command, bytes);
        ASSERT_TRUE(log->write(channel_of(command), now, bytes).ok());
        break;
      }
      default: {
        // The contents do not matter: the newest message of a channel is identified by its bytes.
        const std::string payload = "message " + std::to_string(i);
        bytes.assign(payload.begin(), payload.end());
        const char* channels[] = {channel::kMrWorld, channel::kMrScan, channel::kPoseCov, "MR_AGENT_a_SCAN"};
        ASSERT_TRUE(log->write(channels[below(4)], now, bytes).ok());
      }
    }
  }
}

}  // namespace parhelion::test
