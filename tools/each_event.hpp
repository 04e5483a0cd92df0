// One pass over the events of a log.
#pragma once

#include <cstdint>
#include <string>

#include "protocols/bus/log_file.hpp"
#include "protocols/status.hpp"

namespace parhelion::tools {

/// Calls `take`, which returns a Status, for each event. `damaged`: places that cannot be read, which are
/// passed over. Error: the log cannot be opened, or what `take` returned, which ends the pass.
template <class Take>
Status each_event(const std::string& log, std::uint64_t& damaged, Take take) {
  auto reader = LogReader::open(log);
  if (!reader) return reader.error();
  damaged = 0;
  for (;;) {
    const auto event = reader->next();
    if (!event) {
      ++damaged;
      continue;
    }
    if (!event->has_value()) return {};
    if (const Status status = take(**event); !status) return status;
  }
}

}  // namespace parhelion::tools
