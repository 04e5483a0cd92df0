// A session log that is read from anywhere: where each message lies, and what a place in it is made of.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/status.hpp"
#include "protocols/telemetry.hpp"

namespace parhelion::runtime {

/// An event worth a mark on a seek bar.
struct RecordedMark {
  double t = 0;      ///< s after the session began
  std::string kind;  ///< EventKind in words, or "mark"
  std::string text;  ///< who and what
  bool bad = false;  ///< somebody got hurt, points were lost
};

/// Immutable after open(); one thread at a time reads messages.
class Recording {
 public:
  /// Reads the log once. Error: it cannot be read, or its first message is no MR_SESSION. A damaged place is
  /// left out and counted. `progress`: bytes done and of all; may be empty; false stops.
  static Result<Recording> open(const std::string& path,
                                const std::function<bool(std::uint64_t, std::uint64_t)>& progress = {});
  Recording(Recording&&) noexcept;
  Recording& operator=(Recording&&) noexcept;
  ~Recording();

  const SessionHeader& session() const;
  std::size_t size() const;  ///< messages
  ArrivalTime arrival(std::size_t i) const;
  const std::string& channel(std::size_t i) const;
  /// s after the session began; never falls from one message to the next.
  double t(std::size_t i) const;
  double duration() const;  ///< s, to the last message
  /// How many messages have come by `t` s.
  std::size_t count_until(double t) const;
  /// Into `message`, whose buffers are used again.
  Status read(std::size_t i, Message& message) const;

  /// Messages, ascending, after which a listener knows what one knows that has heard all of [from, to):
  /// commands to agents and events one by one (but for contacts that go on), of all else the newest.
  std::vector<std::size_t> news(std::size_t from, std::size_t to) const;

  const std::vector<RecordedMark>& marks() const;
  std::uint64_t skipped_bytes() const;  ///< lost to damage

 private:
  struct State;
  explicit Recording(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::runtime
