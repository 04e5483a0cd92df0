// Persistent state of a robot's emergency stop, which survives the end of the server: killed, restarted by a
// supervisor, or a power failure.
#pragma once

#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "protocols/status.hpp"

namespace parhelion::tools {

/// A file in the state folder while the stop is active; only an explicit release removes it.
class StopMemory {
 public:
  /// `bus`: its address and port (bus_address()), since robots of other buses may have the same name.
  StopMemory(const std::filesystem::path& folder, const std::string& bus, const std::string& robot);

  /// Fail-safe: true if the state cannot be determined.
  bool holds() const;
  /// The file is written on return, and synced to disk soon after. Error: it could not be stored, with the
  /// reason.
  Status keep(bool holds);
  const std::filesystem::path& path() const { return path_; }

 private:
  void sync_what_is_written(const std::stop_token& stop);

  std::filesystem::path path_;
  const std::string bus_, robot_;
  std::mutex mutex_;
  std::condition_variable_any written_;
  bool to_sync_ = false;
  std::jthread syncer_;  // syncs in the background, since a slow disk must not delay a scan
};

/// The stops that are active, of all robots: the text of each file in the folder.
std::vector<std::string> active_stops(const std::filesystem::path& folder);

}  // namespace parhelion::tools
