// Log-in sessions on the disk, so that a server that dies logs nobody out: whoever was logged in can stop the
// robot at the next one.
#pragma once

#include <condition_variable>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "protocols/status.hpp"
#include "server/station/http/accounts.hpp"
#include "server/station/http/sessions.hpp"

namespace parhelion::station {

struct SessionClocks {
  std::function<WallTime()> wall;    ///< since the epoch: an expiry also holds after a reboot
  std::function<WallTime()> steady;  ///< monotonic: of Sessions
};

/// A private file with the digest of each token, its account, its role and its expiry. Each entry is bound to
/// the password of its account, so no file can bring back what a new password or a removal has ended.
/// Sessions without an account (log-in links) are not in it. Thread-safe.
class SessionFile {
 public:
  /// `file` empty: nothing is stored. `sessions` and `accounts` must outlive this object.
  SessionFile(std::filesystem::path file, SessionLimits limits, Sessions& sessions, const Accounts& accounts,
              SessionClocks clocks);
  /// Stores the last use of each session.
  ~SessionFile();

  /// Adds the sessions of the file that are still valid, and returns how many. Error: the file cannot be
  /// trusted or read, and was ignored. Call before the first save().
  Result<std::size_t> restore();
  /// Calls `then` after the sessions of now are on the disk. It gets an Error if they could not be stored;
  /// the file then is gone, so that no ended session comes back.
  void save(std::function<void(const Status&)> then);

 private:
  using Then = std::function<void(const Status&)>;

  void work(const std::stop_token& stop);
  Status write();
  std::string text() const;
  std::string password_mark(const Identity& who) const;

  const std::filesystem::path file_;
  const SessionLimits limits_;
  Sessions& sessions_;
  const Accounts& accounts_;
  const SessionClocks clocks_;

  std::mutex mutex_;
  std::condition_variable_any asked_;
  std::vector<Then> waiting_;
  std::string written_;  ///< of the thread: what the file contains
  std::jthread thread_;  ///< last: it uses all of the above
};

}  // namespace parhelion::station
