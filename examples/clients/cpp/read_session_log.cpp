// Reads a session log: what ran, how long, how many messages on each channel, how many beams were replaced.
//
//   read_session_log SESSION.lcm
//
// A session log is an LCM event log. The timestamp of an event is the server's: the arrival of an input, or
// the simulation time of an output. The utime inside a message is the sender's, and often earlier.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <string>

#include "parhelion/scan_info_t.hpp"
#include "parhelion/session_t.hpp"

namespace {

struct Summary {
  std::string version;
  std::int64_t start_us = 0;
  std::int64_t end_us = 0;
  std::map<std::string, int> messages;  // by channel
  int scans = 0;
  int live_scans = 0;
  int beams_replaced = 0;
};

/// False where the type of the message does not match its channel.
template <class T>
bool decode(const lcm::LogEvent& event, T& message) {
  return message.decode(event.data, 0, event.datalen) == event.datalen;
}

bool add(const lcm::LogEvent& event, Summary& summary) {
  if (summary.messages.empty()) summary.start_us = event.timestamp;
  summary.end_us = event.timestamp;
  ++summary.messages[event.channel];
  if (event.channel == "MR_SESSION") {  // the first event
    parhelion::session_t session;
    if (!decode(event, session)) return false;
    summary.version = session.version;
  }
  if (event.channel == "MR_SCAN_INFO") {
    parhelion::scan_info_t info;
    if (!decode(event, info)) return false;
    ++summary.scans;
    if (info.live != 0) ++summary.live_scans;
    summary.beams_replaced += static_cast<int>(std::count_if(info.beam_agent.begin(), info.beam_agent.end(),
                                                             [](std::int16_t agent) { return agent >= 0; }));
  }
  return true;
}

void print(const Summary& summary) {
  std::printf("session of %s, %.3f s\n", summary.version.c_str(),
              static_cast<double>(summary.end_us - summary.start_us) * 1e-6);
  for (const auto& [channel, count] : summary.messages) std::printf("%8d  %s\n", count, channel.c_str());
  std::printf("%d of %d scans live, %d beams replaced\n", summary.live_scans, summary.scans,
              summary.beams_replaced);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: read_session_log SESSION.lcm\n");
    return 2;
  }
  lcm::LogFile log(argv[1], "r");
  if (!log.good()) {
    std::fprintf(stderr, "read_session_log: %s: cannot be opened\n", argv[1]);
    return 1;
  }
  Summary summary;
  while (const lcm::LogEvent* event = log.readNextEvent()) {
    if (!add(*event, summary)) {
      std::fprintf(stderr, "read_session_log: %s: event %lld on %s has an unexpected type\n", argv[1],
                   static_cast<long long>(event->eventnum), event->channel.c_str());
      return 1;
    }
  }
  print(summary);
  return 0;
}
