// The audit log: one JSON object per line, in an append-only file.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "protocols/status.hpp"
#include "protocols/time.hpp"

namespace parhelion::station {

struct AuditEntry {
  std::string who;      ///< account; empty: not logged in
  std::string from;     ///< address
  std::string what;     ///< "log in", "spawn box_1"
  std::string outcome;  ///< "done"; else "refused", or the reason
  std::string detail = {};
};

/// Thread-safe. A thread of its own writes, so callers never wait for the disk. At most thirty refusals a
/// minute and network are written in full; the others are counted.
class Audit {
 public:
  /// `clock`: since the epoch. Error: the file cannot be opened for writing.
  static Result<std::unique_ptr<Audit>> open(std::filesystem::path file, std::function<WallTime()> clock);
  /// Writes all waiting lines.
  ~Audit();

  void record(AuditEntry entry);
  /// The last lines, newest first, at most `max_count` (and at most a thousand).
  std::vector<std::string> newest(std::size_t max_count) const;
  /// Lines that were not written, because the disk failed or too many waited.
  std::uint64_t lost() const;
  /// Returns when all earlier lines have been written.
  void flush();

 private:
  Audit(std::filesystem::path file, std::function<WallTime()> clock);
  struct Spell {
    WallTime begun;
    std::uint64_t refusals = 0;
  };
  void put(const AuditEntry& entry, WallTime now);
  void close_spells(WallTime now, bool all);
  void write_lines();
  bool write_out(const std::string& lines);

  const std::filesystem::path file_;
  const std::function<WallTime()> clock_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::string> newest_;       ///< oldest first
  std::vector<std::string> waiting_;     ///< to be written
  std::map<std::string, Spell> spells_;  ///< by network
  std::uint64_t lost_ = 0;
  bool busy_ = false, ending_ = false;
  int descriptor_ = -1;        ///< of the writer thread
  std::uint64_t written_ = 0;  ///< bytes in the file
  std::thread writer_;
};

}  // namespace parhelion::station
