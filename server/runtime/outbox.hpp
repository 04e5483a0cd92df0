// Where outputs leave: onto the session log, then the bus. Written before anything is acknowledged (promise
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
  /// Either may be absent: no bus in a silent replay, no log where none is wanted.
  /// `sent`: told of each message before it goes out.
  Outbox(Bus* bus, std::optional<LogWriter> log, SentMessages* sent = nullptr);

  /// One input and what it led to, in one write; then the outputs go out. Where the write fails (disk full),
  /// scans go out all the same, commands are answered with a refusal, and the session is marked incomplete.
  /// What has gone out by publish_now already (Entry::sent) does not go out again. `note`: on how the input
  /// was answered, written last and in the same write, so that no kill parts it from the answer.
  void send(const Message* input, std::span<const tick::Outputs::Entry> outputs, ArrivalTime stamp,
            const Message* note = nullptr);
  /// Onto the bus only, at once; the log follows with send(). For what must not wait: MR_SCAN. Takes no lock:
  /// the guard speaks while a slow disk holds up a write.
  void publish_now(std::string_view channel, std::span<const std::uint8_t> payload);
  /// An input that will be acknowledged, before anything is done about it. False: it could not be written.
  bool write_input(const Message& input);
  /// To the disk. Sending goes on meanwhile; where it fails, the session is incomplete. One thread at a time.
  Status sync();

  /// False since a write failed.
  bool complete() const;
  std::string log_error() const;
  /// SHA-256 over the payloads in order, for each output channel.
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
