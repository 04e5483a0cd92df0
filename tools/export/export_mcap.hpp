// `parhelion export --mcap`: converts an LCM log to an MCAP file for Foxglove and Lichtblick.
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
  std::string log;     ///< a session log, or any LCM log with `raw`
  std::string output;  ///< MCAP file
  bool overwrite = false;
  bool raw = false;  ///< also copies the LCM messages unchanged, each to `lcm/CHANNEL`
  McapCompression compression = McapCompression::zstd;
  std::function<void(std::uint64_t done, std::uint64_t total)> progress;  ///< bytes of the log
  std::function<bool()> stop;
};

struct ExportReport {
  std::uint64_t events = 0;                       ///< of the log
  std::uint64_t bytes_in = 0, bytes_out = 0;      ///< of the two files
  std::map<std::string, std::uint64_t> messages;  ///< by topic
  std::uint64_t unreadable = 0;                   ///< messages that could not be decoded
  std::string first_unreadable;                   ///< the reason for the first one
  std::uint64_t skipped_bytes = 0;                ///< of the log
  std::vector<std::string> omissions;             ///< content that could not be shown
};

/// Writes the whole file or none. Error: no session in the log (unless `raw`), output not writable, stopped.
Result<ExportReport> export_mcap(const ExportOptions& options);

}  // namespace parhelion::tools
