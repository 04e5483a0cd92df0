#include "server/station/http/sessions.hpp"

#include <algorithm>

#include "server/station/http/token.hpp"

namespace parhelion::station {

std::string Sessions::begin(const Identity& who, WallTime now) {
  std::string token = random_token();
  const std::lock_guard lock(mutex_);
  make_room(who.name, now);
  sessions_[token_digest(token)] = {who, now, now};
  return token;
}

std::optional<Identity> Sessions::find(const std::string& token, WallTime now) {
  const std::string digest = token_digest(token);
  const std::lock_guard lock(mutex_);
  const auto session = sessions_.find(digest);
  if (session == sessions_.end()) return std::nullopt;
  if (over(session->second, now)) {
    sessions_.erase(session);
    return std::nullopt;
  }
  session->second.used = now;
  return session->second.who;
}

bool Sessions::has(const std::string& name, WallTime now) const {
  const std::lock_guard lock(mutex_);
  return std::any_of(sessions_.begin(), sessions_.end(), [&](const auto& entry) {
    return entry.second.who.name == name && !over(entry.second, now);
  });
}

void Sessions::end(const std::string& token) {
  const std::lock_guard lock(mutex_);
  sessions_.erase(token_digest(token));
}

void Sessions::end_all(const std::string& name, const std::string& but) {
  const std::string kept = but.empty() ? "" : token_digest(but);
  const std::lock_guard lock(mutex_);
  std::erase_if(sessions_,
                [&](const auto& entry) { return entry.second.who.name == name && entry.first != kept; });
}

std::size_t Sessions::count() const {
  const std::lock_guard lock(mutex_);
  return sessions_.size();
}

std::map<std::string, Session> Sessions::all() const {
  const std::lock_guard lock(mutex_);
  return sessions_;
}

void Sessions::restore(const std::string& digest, const Session& session) {
  const std::lock_guard lock(mutex_);
  sessions_[digest] = session;
}

bool Sessions::over(const Session& session, WallTime now) const {
  return now - session.used >= limits_.idle || now - session.begun >= limits_.absolute;
}

void Sessions::make_room(const std::string& name, WallTime now) {
  std::erase_if(sessions_, [&](const auto& entry) { return over(entry.second, now); });
  std::size_t own = 0;
  auto oldest = sessions_.end();
  for (auto session = sessions_.begin(); session != sessions_.end(); ++session) {
    if (session->second.who.name != name) continue;
    ++own;
    if (oldest == sessions_.end() || session->second.begun < oldest->second.begun) oldest = session;
  }
  if (own >= limits_.per_account) sessions_.erase(oldest);
}

}  // namespace parhelion::station
