// Grades many session logs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "server/runtime/session_record.hpp"

namespace parhelion::runtime {

/// Summary of a session: small, so that memory does not grow with session length.
struct BatchRow {
  std::string log;    ///< path as given
  std::string error;  ///< why it could not be graded; the fields below are then unset
  std::string identity, scenario, robot, grade;
  int level = 0;
  double score = 0, awarded = 0, deducted = 0, max = 0, fraction = 0;
  bool passed = false, complete = false;
  std::size_t tasks = 0, tasks_done = 0, deductions = 0;
  double duration = 0;  ///< s
  std::uint64_t skipped_bytes = 0;
};

/// The session logs (*.lcm) of each folder, recursively, and the named files; sorted, without duplicates.
/// Error: a path does not exist, or a folder cannot be read or contains no log.
Result<std::vector<std::string>> session_logs(const std::vector<std::string>& places);

/// Every `shards`-th of `logs`, starting at `shard` (from 0): the part of one of several machines.
std::vector<std::string> shard_of(const std::vector<std::string>& logs, std::size_t shard,
                                  std::size_t shards);

/// Grades one log in this process.
BatchRow grade_log(const std::string& log);

/// The process in which each log is graded, so that one that crashes or needs too much does not end the
/// others.
struct GradeProcess {
  std::uint64_t bytes = std::uint64_t{1} << 30U;  ///< that it may allocate
  std::uint64_t seconds = 60;                     ///< of processor time, and one more for each 2 MB of log
  std::function<BatchRow(const std::string&)> grade = grade_log;
};

/// A row for each log, in order, the same for any number of processes at once (at least 1). The error of a
/// row whose process died gives the reason. `progress`: logs done and in total; may be empty.
std::vector<BatchRow> grade_batch(const std::vector<std::string>& logs, unsigned at_once,
                                  const std::function<void(std::size_t, std::size_t)>& progress = {},
                                  const GradeProcess& process = {});

/// CSV by RFC 4180 with a header line; a JSON array of objects. Numbers convert back to the same bits.
std::string to_csv(const std::vector<BatchRow>& rows);
std::string to_json(const std::vector<BatchRow>& rows);

}  // namespace parhelion::runtime
