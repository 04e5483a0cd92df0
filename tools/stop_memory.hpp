// Whether a robot is stopped by an emergency stop, kept where it outlives the server however that ends:
// killed, restarted by whoever watches it, or the machine without power.
#pragma once

#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>

#include "protocols/status.hpp"

namespace parhelion::tools {

/// A file in the state folder while the stop holds; only an explicit release takes it away.
class StopMemory {
 public:
  /// `url`: of the bus: robots of other cells may have the same name.
  StopMemory(const std::filesystem::path& folder, const std::string& url, const std::string& robot);

  /// Fails to a stop: what cannot be looked up holds.
  bool holds() const;
  /// Written when this returns, on the disk soon after. Error: it is not kept, and why.
  Status keep(bool holds);
  const std::filesystem::path& path() const { return path_; }

 private:
  void sync_what_is_written(const std::stop_token& stop);

  std::filesystem::path path_;
  std::string robot_;
  std::mutex mutex_;
  std::condition_variable_any written_;
  bool to_sync_ = false;
  std::jthread syncer_;  // a slow disk holds up no scan
};

}  // namespace parhelion::tools
