// Persistent state of a robot's emergency stop, which survives the end of the server: killed, restarted by a
// supervisor, or a power failure.
#pragma once

#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>

#include "protocols/status.hpp"

namespace parhelion::tools {

/// A file in the state folder while the stop is active; only an explicit release removes it.
class StopMemory {
 public:
  /// `url`: of the bus, since robots of other buses may have the same name.
  StopMemory(const std::filesystem::path& folder, const std::string& url, const std::string& robot);

  /// Fail-safe: true if the state cannot be determined.
  bool holds() const;
  /// The file is written on return, and synced to disk soon after. Error: it could not be stored, with the
  /// reason.
  Status keep(bool holds);
  const std::filesystem::path& path() const { return path_; }

 private:
  void sync_what_is_written(const std::stop_token& stop);

  std::filesystem::path path_;
  std::string robot_;
  std::mutex mutex_;
  std::condition_variable_any written_;
  bool to_sync_ = false;
  std::jthread syncer_;  // syncs in the background, since a slow disk must not delay a scan
};

}  // namespace parhelion::tools
