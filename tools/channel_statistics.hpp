// Statistics of a channel: bandwidth, rate, jitter, and an estimate of lost messages.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/codec.hpp"

namespace parhelion::tools {

/// us; nullopt: the type is none of Parhelion's, whose first member is `utime`.
std::optional<std::int64_t> utime_of(Bytes payload);

class ChannelStatistics {
 public:
  void add(const Message& message);

  std::uint64_t count() const { return count_; }
  std::uint64_t bytes() const { return bytes_; }
  /// Wire type of the newest message; "mixed" if there were several types.
  const std::string& type() const { return type_; }
  /// Messages a second between the first and the last arrival; 0 below two messages.
  double rate() const;
  /// Standard deviation of the time between two arrivals, s.
  double jitter() const;
  /// Shortest and longest time between two arrivals, s; 0 below two messages.
  double shortest() const;
  double longest() const;
  /// Estimated number of lost messages: how many median intervals each gap between two stamps contains beyond
  /// one. Uses the sensor's stamps if all messages have one, else arrival times. LCM does not number
  /// messages.
  std::uint64_t lost() const;

 private:
  std::uint64_t count_ = 0;
  std::uint64_t bytes_ = 0;
  std::string type_;
  std::vector<std::int64_t> arrivals_;  // us
  std::vector<std::int64_t> stamps_;    // us, of messages whose first member is a utime
};

}  // namespace parhelion::tools
