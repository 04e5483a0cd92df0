// Log-in sessions, by the token in the browser's cookie. session_file.hpp keeps them over a restart.
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "protocols/time.hpp"
#include "server/station/http/identity.hpp"

namespace parhelion::station {

struct SessionLimits {
  Duration idle = seconds(2 * 3600.0);       ///< maximum time without use; an open page counts as use
  Duration absolute = seconds(12 * 3600.0);  ///< maximum age
  std::size_t per_account = 16;              ///< a new session ends the oldest one
};

/// Instants of a monotonic clock.
struct Session {
  Identity who;
  WallTime begun, used;
};

/// Thread-safe. Instants of a monotonic clock.
class Sessions {
 public:
  explicit Sessions(SessionLimits limits = {}) : limits_(limits) {}

  /// The token for the cookie.
  std::string begin(const Identity& who, WallTime now);
  /// nullopt: unknown, ended or expired. Counts as use.
  std::optional<Identity> find(const std::string& token, WallTime now);
  /// True if somebody is logged in under this name.
  bool has(const std::string& name, WallTime now) const;
  void end(const std::string& token);
  /// Except the session of this token, if any.
  void end_all(const std::string& name, const std::string& but = {});
  std::size_t count() const;
  /// By token_digest.
  std::map<std::string, Session> all() const;
  /// Adds a session of an earlier process, by the digest of its token.
  void restore(const std::string& digest, const Session& session);

 private:
  bool over(const Session& session, WallTime now) const;
  void make_room(const std::string& name, WallTime now);

  const SessionLimits limits_;
  mutable std::mutex mutex_;
  std::map<std::string, Session> sessions_;  ///< by token_digest
};

}  // namespace parhelion::station
