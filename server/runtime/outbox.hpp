// Output of a session: to the session log, then to the bus. Logged before anything is acknowledged (promise
// 6).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/bus/log_file.hpp"
#include "protocols/sha256.hpp"
#include "server/runtime/sent_messages.hpp"
#include "server/tick/outputs.hpp"

namespace parhelion::runtime {

/// Thread-safe: the loop, the guard and the render thread all send through it.
class Outbox {
 public:
  /// Either may be absent: no bus in a silent replay, no log where none is wanted. `sent`: receives each
  /// message before it is published.
  Outbox(Bus* bus, std::optional<LogWriter> log, SentMessages* sent = nullptr);

  /// Writes one input and its outputs in one write, then publishes the outputs. If the write fails (disk
  /// full), scans are still published, commands are answered with a refusal, and the session is marked
  /// incomplete. Outputs already published by publish_now (Entry::sent) are not published again. `note`: how
  /// the input was answered, last in the same write, so that a kill cannot separate it from the answer.
  void send(const Message* input, std::span<const tick::Outputs::Entry> outputs, ArrivalTime stamp,
            const Message* note = nullptr);
  /// Publishes on the bus immediately; send() logs it later. For MR_SCAN, which must not wait. Takes no lock:
  /// the guard can publish while a slow disk delays a write.
  void publish_now(std::string_view channel, std::span<const std::uint8_t> payload);
  /// Logs an input that will be acknowledged, before it is applied. False: it could not be written.
  bool write_input(const Message& input);
  /// Flushes to the disk while sending continues; on failure the session is incomplete. One thread at a time.
  Status sync();

  /// Ends the log: nothing more is written, and the session is incomplete.
  void give_up_log(const std::string& reason);

  /// False since a write failed or the log was given up.
  bool complete() const;
  std::string log_error() const;
  /// SHA-256 over the payloads in order, per output channel.
  std::map<std::string, std::string> hashes() const;

 private:
  void record(const Message* input, std::span<const tick::Outputs::Entry> outputs, ArrivalTime stamp,
              const Message* note);
  void write(std::span<const Message> messages);

  mutable std::mutex mutex_;
  Bus* bus_;
  SentMessages* sent_;
  std::optional<LogWriter> log_;
  std::string log_error_;
  std::map<std::string, Sha256> hashes_;
  std::vector<Message> batch_;
};

}  // namespace parhelion::runtime
