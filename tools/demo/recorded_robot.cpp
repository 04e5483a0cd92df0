#include "tools/demo/recorded_robot.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "protocols/codec.hpp"

namespace parhelion::tools {
namespace {

constexpr std::size_t kStampAt = 8;  // after the fingerprint: utime, big-endian

/// Every type begins with its utime.
void move_stamp(Message& message, Duration by) {
  std::uint64_t utime = 0;
  for (std::size_t i = 0; i < 8; ++i) utime = utime << 8 | message.payload[kStampAt + i];
  utime += static_cast<std::uint64_t>(by.ns / 1000);
  for (std::size_t i = 8; i-- > 0; utime >>= 8) message.payload[kStampAt + i] = utime & 0xFF;
  message.arrival = message.arrival + by;
}

}  // namespace

Result<RecordedRobot> RecordedRobot::open(const std::string& log,
                                          std::function<bool(const std::string&)> speaks,
                                          const std::string& pace, ArrivalTime start) {
  auto ahead = LogReader::open(log);
  if (!ahead) return ahead.error();
  std::optional<ArrivalTime> first, before, last;
  while (true) {
    const auto next = ahead->next();
    if (!next) return next.error();
    if (!*next) break;
    const Message& message = **next;
    if (!first && speaks(message.channel)) first = message.arrival;
    if (message.channel != pace) continue;
    before = std::exchange(last, message.arrival);
  }
  if (!before || *last <= *before)
    return Error{log + ": fewer than two messages on " + pace + "; expected a robot's recording"};
  auto reader = LogReader::open(log);
  if (!reader) return reader.error();
  RecordedRobot robot(std::move(*reader));
  robot.speaks_ = std::move(speaks);
  robot.ahead_ = start - *first;
  robot.ahead_.ns -= robot.ahead_.ns % 1000;
  robot.period_ = *last - *before;
  robot.period_.ns -= robot.period_.ns % 1000;
  return robot;
}

Result<bool> RecordedRobot::next_recorded(Message& message) {
  while (true) {
    auto next = log_.next();
    if (!next) return next.error();
    if (!*next) return false;
    if (!speaks_((*next)->channel)) continue;
    message = std::move(**next);
    if (leading_stamp(message.payload)) return true;
    ++passed_over_;
  }
}

/// The last message of each channel, in turn.
Message RecordedRobot::stand() {
  if (last_.empty()) {
    for (auto& [channel, message] : newest_) last_.push_back(std::move(message));
    std::stable_sort(last_.begin(), last_.end(),
                     [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
    // The last message of a channel that was silent for long is repeated with the others.
    const ArrivalTime end = last_.back().arrival;
    for (Message& message : last_) {
      const Duration behind = end - message.arrival;
      if (behind > period_) move_stamp(message, nanoseconds((behind.ns - period_.ns) / 1000 * 1000));
    }
    std::stable_sort(last_.begin(), last_.end(),
                     [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
  }
  const auto round = static_cast<std::int64_t>(standing_ / last_.size()) + 1;
  Message message = last_[standing_++ % last_.size()];
  move_stamp(message, nanoseconds(ahead_.ns + round * period_.ns));
  return message;
}

Result<Message> RecordedRobot::next() {
  if (standing_ > 0) return stand();
  Message message;
  const auto came = next_recorded(message);
  if (!came) return came.error();
  if (!*came) return stand();
  newest_[message.channel] = message;
  move_stamp(message, ahead_);
  return message;
}

}  // namespace parhelion::tools
