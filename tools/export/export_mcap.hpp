// An LCM log as an MCAP file that Foxglove and Lichtblick open: what `parhelion export --mcap` does.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "tools/export/mcap_writer.hpp"

namespace parhelion::tools {

struct ExportOptions {
  std::string log;     ///< a session log, or with `raw` any LCM log
  std::string output;  ///< MCAP file
  bool overwrite = false;
  bool raw = false;  ///< the LCM messages as they are, too, each on `lcm/CHANNEL`
  McapCompression compression = McapCompression::zstd;
  std::function<void(std::uint64_t done, std::uint64_t total)> progress;  ///< bytes of the log
  std::function<bool()> stop;
};

struct ExportReport {
  std::uint64_t events = 0;                       ///< of the log
  std::uint64_t bytes_in = 0, bytes_out = 0;      ///< of the two files
  std::map<std::string, std::uint64_t> messages;  ///< by topic
  std::uint64_t unreadable = 0;                   ///< messages that could not be decoded
  std::string first_unreadable;                   ///< and why
  std::uint64_t damaged_bytes = 0;                ///< of the log
  std::vector<std::string> omissions;             ///< what could not be shown
};

/// Whole or not at all. Error: no session in the log (but with `raw`), nothing to write to, stopped.
Result<ExportReport> export_mcap(const ExportOptions& options);

}  // namespace parhelion::tools
