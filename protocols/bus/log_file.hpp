// LCM event logs: a reader with more checks than liblcm's, and a writer that survives a kill (promise 6).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "protocols/bus/bus.hpp"
#include "protocols/status.hpp"

namespace parhelion {

/// Reads events in file order. Event: big-endian 0xEDA1DA01, int64 number, int64 utime, int32 channel length,
/// int32 data length, channel, data.
class LogReader {
 public:
  static Result<LogReader> open(const std::string& path);
  LogReader(LogReader&&) noexcept;
  LogReader& operator=(LogReader&&) noexcept;
  ~LogReader();

  /// The next event; nullopt at a clean end. Damaged data give an Error that names file and byte offset;
  /// reading on resumes at the next sync word, and the skipped bytes are counted.
  Result<std::optional<Message>> next();
  std::uint64_t offset() const;         ///< bytes read so far
  std::uint64_t size() const;           ///< bytes of the file when opened
  std::uint64_t skipped_bytes() const;  ///< skipped because of damage

 private:
  struct State;
  explicit LogReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Appends events; each write reaches the kernel before it returns, so a killed process loses no written
/// event.
class LogWriter {
 public:
  /// Fails where the file exists, unless `overwrite`: then it keeps its events until the first write. A file
  /// that is created and never written is removed again.
  static Result<LogWriter> create(const std::string& path, bool overwrite);
  LogWriter(LogWriter&&) noexcept;
  LogWriter& operator=(LogWriter&&) noexcept;
  ~LogWriter();

  /// One write(2) per call; after an error (disk full) the file is truncated to the last complete event.
  Status write(std::string_view channel, ArrivalTime stamp, std::span<const std::uint8_t> payload);
  /// Several events with one write(2); all or none.
  Status write(std::span<const Message> messages);
  /// fdatasync.
  Status sync();

 private:
  struct State;
  explicit LogWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion
