// Finds differences between two session logs that should be identical: which message, and which field.
#pragma once

#include <algorithm>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"

namespace parhelion::test {

using Payloads = std::map<std::string, std::vector<std::vector<std::uint8_t>>>;

inline Payloads payloads_by_channel(const std::string& log) {
  Payloads all;
  auto reader = LogReader::open(log);
  while (reader.ok()) {
    auto next = reader->next();
    if (!next.ok() || !*next) break;
    all[(*next)->channel].push_back((*next)->payload);
  }
  return all;
}

inline std::string scan_info_fields(const ScanInfo& live, const ScanInfo& replayed) {
  std::string text;
  const auto differ = [&](const char* field, const std::string& a, const std::string& b) {
    if (a != b) text += std::string("\n    ") + field + ": live " + a + ", replayed " + b;
  };
  const auto exact = [](double value) {
    char digits[40];
    std::snprintf(digits, sizeof digits, "%.17g", value);
    return std::string(digits);
  };
  const auto names = [](const ScanInfo& info) {
    std::string list;
    for (const std::string& name : info.agents) list += name + " ";
    return list;
  };
  differ("utime", std::to_string(live.stamp.utime()), std::to_string(replayed.stamp.utime()));
  differ("live", live.live ? "true" : "false", replayed.live ? "true" : "false");
  differ("reason", live.reason, replayed.reason);
  differ("predicted_error", exact(live.predicted_error), exact(replayed.predicted_error));
  differ("pose", live.pose, replayed.pose);
  differ("residual", exact(live.residual), exact(replayed.residual));
  differ("agents", names(live), names(replayed));
  const std::size_t beams = std::min(live.beam_agent.size(), replayed.beam_agent.size());
  for (std::size_t i = 0; i < beams; ++i) {
    if (live.beam_agent[i] == replayed.beam_agent[i]) continue;
    differ(("beam_agent " + std::to_string(i)).c_str(), std::to_string(live.beam_agent[i]),
           std::to_string(replayed.beam_agent[i]));
    break;
  }
  return text;
}

inline std::string payload_difference(const std::string& name, const std::vector<std::uint8_t>& live,
                                      const std::vector<std::uint8_t>& replayed) {
  const auto apart = std::mismatch(live.begin(), live.end(), replayed.begin(), replayed.end());
  std::string text = " from byte " + std::to_string(apart.first - live.begin()) + " of " +
                     std::to_string(live.size()) + "\n    live:     " + describe(name, live) +
                     "\n    replayed: " + describe(name, replayed);
  ScanInfo a, b;
  if (decode(name, live, a).ok() && decode(name, replayed, b).ok()) text += scan_info_fields(a, b);
  return text;
}

/// For failure messages of tests; empty without a difference. The first differing messages of each channel,
/// and extra messages of one log.
inline std::string difference(const std::string& live_log, const std::string& replayed_log) {
  constexpr int max_reported = 3;
  Payloads live = payloads_by_channel(live_log), replayed = payloads_by_channel(replayed_log);
  for (const auto& [name, payloads] : replayed) live.try_emplace(name);
  std::string text;
  for (const auto& [name, ours] : live) {
    const auto& theirs = replayed[name];
    if (ours.size() != theirs.size()) {
      text += "\n  " + name + ": live " + std::to_string(ours.size()) + " messages, replayed " +
              std::to_string(theirs.size());
    }
    int reported = 0;
    for (std::size_t i = 0; i < std::min(ours.size(), theirs.size()) && reported < max_reported; ++i) {
      if (ours[i] == theirs[i]) continue;
      text += "\n  " + name + " " + std::to_string(i) + payload_difference(name, ours[i], theirs[i]);
      ++reported;
    }
  }
  return text;
}

}  // namespace parhelion::test
