// Many session logs, graded at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "server/runtime/session_record.hpp"

namespace parhelion::runtime {

/// What is kept of a session: little, so that memory does not grow with their length.
struct BatchRow {
  std::string log;    ///< as it was given
  std::string error;  ///< why it could not be graded; all below is then unset
  std::string identity, scenario, robot, grade;
  int level = 0;
  double score = 0, earned = 0, charged = 0, most = 0, share = 0;
  bool passed = false, complete = false;
  std::size_t tasks = 0, tasks_done = 0, charges = 0;
  double duration = 0;  ///< s
  std::uint64_t damaged_bytes = 0;
};

/// The session logs (*.lcm) of each folder and all folders in it, and the files that are named; sorted, each
/// once. Error: one is not there, or a folder cannot be read or has none.
Result<std::vector<std::string>> session_logs(const std::vector<std::string>& places);

/// Every `shards`-th of `logs`, from number `shard` (from 0) on: what one of several machines takes.
std::vector<std::string> shard_of(const std::vector<std::string>& logs, std::size_t shard,
                                  std::size_t shards);

/// A row for each log, in their order, the same for any number of threads (at least 1). `progress`: logs done
/// and of all; called by one thread at a time; may be empty.
std::vector<BatchRow> grade_batch(const std::vector<std::string>& logs, unsigned threads,
                                  const std::function<void(std::size_t, std::size_t)>& progress = {});

/// RFC 4180 with a header line; an array of objects. Numbers read back to the same bits.
std::string to_csv(const std::vector<BatchRow>& rows);
std::string to_json(const std::vector<BatchRow>& rows);

}  // namespace parhelion::runtime
