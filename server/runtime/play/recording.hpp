// Random access to a session log: the index of its messages, and the state at any position.
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

/// An event to mark on a seek bar.
struct RecordedMark {
  double t = 0;      ///< s since the session's start
  std::string kind;  ///< name of the EventKind, or "mark"
  std::string text;  ///< description
  bool bad = false;  ///< an injury or a deduction
};

/// Immutable after open(); only one thread at a time may read messages.
class Recording {
 public:
  /// Indexes the log. Error: it cannot be read, or its first message is not MR_SESSION. Damaged parts are
  /// skipped and counted, damaged stamps and long gaps are not waited for (play_times.hpp); findings() has
  /// both. `progress`: bytes done and in total; may be empty; false stops.
  static Result<Recording> open(const std::string& path,
                                const std::function<bool(std::uint64_t, std::uint64_t)>& progress = {});
  Recording(Recording&&) noexcept;
  Recording& operator=(Recording&&) noexcept;
  ~Recording();

  const SessionHeader& session() const;
  std::size_t size() const;  ///< messages
  ArrivalTime arrival(std::size_t i) const;
  const std::string& channel(std::size_t i) const;
  /// The arrival that is played at `t` s.
  ArrivalTime arrival_at(double t) const;
  /// s since the session's start, without long gaps; does not decrease.
  double t(std::size_t i) const;
  double duration() const;  ///< s, to the last message
  /// Number of messages up to `t` s.
  std::size_t count_until(double t) const;
  /// Reads into `message`, whose buffers are reused.
  Status read(std::size_t i, Message& message) const;

  /// Indices of the messages, ascending, that give a receiver the same state as all of [from, to): every
  /// command to agents and every event (except contact_continues), and the newest of all others.
  std::vector<std::size_t> news(std::size_t from, std::size_t to) const;

  const std::vector<RecordedMark>& marks() const;
  std::uint64_t skipped_bytes() const;  ///< lost to damage
  /// What is damaged, for people, a line each with file and byte; after the first ten only their number.
  std::vector<std::string> findings() const;

 private:
  struct State;
  explicit Recording(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::runtime
