#include "server/station/http/audit.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <ctime>

#include "server/station/http/http_message.hpp"
#include "server/station/http/request_checks.hpp"

namespace parhelion::station {
namespace {

constexpr std::size_t kMaxKept = 1000, kMaxWaiting = 10'000, kMaxSpells = 1024, kLongestText = 500;
constexpr std::uint64_t kRefusalsInFull = 30;
constexpr std::uint64_t kFileBytes = 16 * 1024 * 1024;  ///< then the file is renamed to FILE.old
constexpr Duration kSpell = seconds(60.0);

std::string iso_time(WallTime time) {
  const std::time_t whole = static_cast<std::time_t>(time.ns / 1'000'000'000);
  std::tm parts{};
  gmtime_r(&whole, &parts);
  std::array<char, 32> text{};
  const std::size_t length = std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &parts);
  const std::string milliseconds = std::to_string(1000 + time.ns / 1'000'000 % 1000).substr(1);
  return std::string(text.data(), length) + "." + milliseconds + "Z";
}

std::string line(const AuditEntry& entry, WallTime now) {
  const auto member = [](const char* key, const std::string& text) {
    return ",\"" + std::string(key) + "\":" + json_text(std::string_view(text).substr(0, kLongestText));
  };
  return "{\"time\":\"" + iso_time(now) + "\"" + member("who", entry.who) + member("from", entry.from) +
         member("what", entry.what) + member("outcome", entry.outcome) + member("detail", entry.detail) + "}";
}

int open_for_adding(const std::filesystem::path& file) {
  return ::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_NOFOLLOW | O_CLOEXEC, 0600);
}

}  // namespace

Result<std::unique_ptr<Audit>> Audit::open(std::filesystem::path file, std::function<WallTime()> clock) {
  std::unique_ptr<Audit> audit(new Audit(std::move(file), std::move(clock)));
  audit->descriptor_ = open_for_adding(audit->file_);
  if (audit->descriptor_ < 0) {
    return Error{audit->file_.string() + ": cannot be written: " + std::strerror(errno) +
                 "; the audit log is required"};
  }
  struct stat attributes {};
  if (fstat(audit->descriptor_, &attributes) == 0)
    audit->written_ = static_cast<std::uint64_t>(attributes.st_size);
  audit->writer_ = std::thread([self = audit.get()] { self->write_lines(); });
  return audit;
}

Audit::Audit(std::filesystem::path file, std::function<WallTime()> clock)
    : file_(std::move(file)), clock_(std::move(clock)) {}

Audit::~Audit() {
  {
    const std::lock_guard lock(mutex_);
    close_spells(clock_(), true);
    ending_ = true;
  }
  changed_.notify_all();
  if (writer_.joinable()) writer_.join();
  if (descriptor_ >= 0) ::close(descriptor_);
}

void Audit::record(AuditEntry entry) {
  const WallTime now = clock_();
  const std::lock_guard lock(mutex_);
  close_spells(now, false);
  if (entry.outcome != "done") {
    // When the table is full, further networks share one entry.
    std::string key = network_of(entry.from);
    if (spells_.size() >= kMaxSpells && !spells_.contains(key)) key = "others";
    Spell& running = spells_.try_emplace(key, Spell{now, 0}).first->second;
    if (++running.refusals > kRefusalsInFull) return;
  }
  put(entry, now);
}

std::vector<std::string> Audit::newest(std::size_t max_count) const {
  const std::lock_guard lock(mutex_);
  return {newest_.rbegin(),
          newest_.rbegin() + static_cast<std::ptrdiff_t>(std::min(max_count, newest_.size()))};
}

std::uint64_t Audit::lost() const {
  const std::lock_guard lock(mutex_);
  return lost_;
}

void Audit::flush() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return waiting_.empty() && !busy_; });
}

void Audit::put(const AuditEntry& entry, WallTime now) {
  std::string text = line(entry, now);
  newest_.push_back(text);
  if (newest_.size() > kMaxKept) newest_.pop_front();
  if (waiting_.size() >= kMaxWaiting) {
    ++lost_;
    return;
  }
  waiting_.push_back(std::move(text) + "\n");
  changed_.notify_all();
}

void Audit::close_spells(WallTime now, bool all) {
  for (auto it = spells_.begin(); it != spells_.end();) {
    const Spell& running = it->second;
    if (!all && now - running.begun < kSpell) {
      ++it;
      continue;
    }
    if (running.refusals > kRefusalsInFull) {
      put({"", it->first, "more of the same", "refused",
           std::to_string(running.refusals - kRefusalsInFull) + " more"},
          now);
    }
    it = spells_.erase(it);
  }
}

void Audit::write_lines() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return ending_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    busy_ = true;
    std::vector<std::string> taken;
    taken.swap(waiting_);
    lock.unlock();
    std::string lines;
    for (const std::string& text : taken) lines += text;
    const bool written = write_out(lines);
    lock.lock();
    busy_ = false;
    if (!written) lost_ += taken.size();
    changed_.notify_all();
  }
}

bool Audit::write_out(const std::string& lines) {
  if (written_ > 0 && written_ + lines.size() > kFileBytes) {
    std::rename(file_.c_str(), (file_.string() + ".old").c_str());
    ::close(descriptor_);
    descriptor_ = open_for_adding(file_);
    written_ = 0;
  }
  // One write: a line is complete, or truncated once on a full disk.
  const ssize_t written = ::write(descriptor_, lines.data(), lines.size());
  if (written > 0) written_ += static_cast<std::uint64_t>(written);
  return written == static_cast<ssize_t>(lines.size());
}

}  // namespace parhelion::station
