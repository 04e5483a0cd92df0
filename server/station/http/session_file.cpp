#include "server/station/http/session_file.hpp"

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "server/station/http/private_file.hpp"
#include "server/station/http/token.hpp"

namespace parhelion::station {
namespace {

/// Longest loss of a session's last use by a crash.
constexpr std::chrono::minutes kUsePeriod{1};
/// By as much a clock may be corrected between two servers.
constexpr double kClockStep = 60;

double epoch_s(WallTime at) { return std::floor(static_cast<double>(at.ns) / 1e9); }

/// An entry of the file.
struct Entry {
  std::string token, account, role, password;
  double expires = 0, used = 0;  ///< s since the epoch
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Entry, token, account, role, password, expires, used)

Result<std::vector<Entry>> parse(const std::string& text) {
  try {
    return nlohmann::json::parse(text).at("sessions").get<std::vector<Entry>>();
  } catch (const nlohmann::json::exception& fault) {
    return Error{fault.what()};
  }
}

}  // namespace

SessionFile::SessionFile(std::filesystem::path file, SessionLimits limits, Sessions& sessions,
                         const Accounts& accounts, SessionClocks clocks)
    : file_(std::move(file)),
      limits_(limits),
      sessions_(sessions),
      accounts_(accounts),
      clocks_(std::move(clocks)),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

SessionFile::~SessionFile() {
  thread_.request_stop();
  thread_.join();
}

Result<std::size_t> SessionFile::restore() {
  if (file_.empty()) return std::size_t{0};
  const auto text = read_private_file(file_);
  if (!text) return text.error();
  if (!*text) return std::size_t{0};
  const auto entries = parse(**text);
  if (!entries) return Error{file_.string() + ": damaged: " + entries.error().message};
  const WallTime steady = clocks_.steady();
  const double now = epoch_s(clocks_.wall()), longest = limits_.absolute.seconds();
  std::size_t restored = 0;
  for (const Entry& entry : *entries) {
    const std::optional<Identity> who = accounts_.find(entry.account);
    if (!who || role_name(who->role) != entry.role || entry.password != password_mark(*who)) continue;
    // Negated, so that nothing but a number in range passes. A clock that was set back extends no session.
    const double left = entry.expires - now, unused = std::max(0.0, now - entry.used);
    if (!(left > 0 && left <= longest + kClockStep && unused < limits_.idle.seconds())) continue;
    const Duration age = limits_.absolute - seconds(std::min(left, longest));
    sessions_.restore(entry.token, {*who, steady - age, steady - seconds(unused)});
    ++restored;
  }
  return restored;
}

void SessionFile::save(Then then) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(std::move(then));
  asked_.notify_one();
}

void SessionFile::work(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  // Once more after the stop, however early it came: the last uses are not in the file yet.
  for (bool ends = false; !ends || !waiting_.empty();) {
    asked_.wait_for(lock, stop, kUsePeriod, [this] { return !waiting_.empty(); });
    ends = stop.stop_requested();
    const std::vector<Then> asked = std::exchange(waiting_, {});
    lock.unlock();
    const Status stored = write();
    for (const Then& then : asked) then(stored);
    lock.lock();
  }
}

Status SessionFile::write() {
  if (file_.empty()) return {};
  std::string now = text();
  if (now == written_) return {};
  const Status stored = write_private_file(file_, now);
  if (!stored) ::unlink(file_.c_str());
  written_ = stored ? std::move(now) : "";
  return stored;
}

std::string SessionFile::text() const {
  const WallTime steady = clocks_.steady(), wall = clocks_.wall();
  std::vector<Entry> entries;
  for (const auto& [token, session] : sessions_.all()) {
    const std::optional<Identity> account = accounts_.find(session.who.name);
    if (!account || account->role != session.who.role) continue;
    entries.push_back({token, session.who.name, std::string(role_name(session.who.role)),
                       password_mark(session.who),
                       epoch_s(wall - (steady - session.begun) + limits_.absolute),
                       epoch_s(wall - (steady - session.used))});
  }
  return nlohmann::json{{"sessions", entries}}.dump(1) + "\n";
}

std::string SessionFile::password_mark(const Identity& who) const {
  return token_digest(accounts_.hash(who.name));
}

}  // namespace parhelion::station
