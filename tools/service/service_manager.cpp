#include "tools/service/service_manager.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string_view>
#include <utility>

namespace parhelion::tools {
namespace {

std::string_view environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string_view() : value;
}

/// nullopt: not set.
Result<std::optional<std::int64_t>> number_in_environment(const char* name) {
  const std::string_view text = environment(name);
  if (text.empty()) return std::optional<std::int64_t>();
  std::int64_t number = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  if (read.ec != std::errc() || read.ptr != text.data() + text.size() || number < 0)
    return Error{std::string(name) + "='" + std::string(text) +
                 "': expected a whole number; unset it outside a service"};
  return std::optional(number);
}

/// How often the manager wants WATCHDOG=1 of this process; 0: not at all.
Result<std::chrono::microseconds> watchdog_timeout() {
  const auto timeout = number_in_environment("WATCHDOG_USEC");
  if (!timeout) return timeout.error();
  const auto process = number_in_environment("WATCHDOG_PID");
  if (!process) return process.error();
  // The variables of another process may have been inherited.
  if (process->value_or(getpid()) != getpid()) return std::chrono::microseconds(0);
  return std::chrono::microseconds(timeout->value_or(0));
}

}  // namespace

Result<ServiceManager> ServiceManager::from_environment() {
  ServiceManager manager;
  const std::string_view path = environment("NOTIFY_SOCKET");
  if (path.empty()) return manager;
  if ((path[0] != '/' && path[0] != '@') || path.size() < 2 ||
      path.size() >= sizeof manager.address_.sun_path)
    return Error{"NOTIFY_SOCKET='" + std::string(path) +
                 "': expected an absolute path or @NAME; unset it outside a service"};
  const auto watchdog = watchdog_timeout();
  if (!watchdog) return watchdog.error();
  manager.watchdog_ = *watchdog;
  manager.address_.sun_family = AF_UNIX;
  std::copy(path.begin(), path.end(), manager.address_.sun_path);
  if (path[0] == '@') manager.address_.sun_path[0] = '\0';  // a name without a file, unix(7)
  manager.address_size_ = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size());
  manager.socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (manager.socket_ < 0)
    return Error{std::string("no socket for the messages to the service manager: ") + std::strerror(errno)};
  return manager;
}

ServiceManager::ServiceManager(ServiceManager&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)),
      address_(other.address_),
      address_size_(other.address_size_),
      watchdog_(other.watchdog_),
      fed_(other.fed_),
      ready_(other.ready_) {}

ServiceManager::~ServiceManager() {
  if (socket_ >= 0) close(socket_);
}

bool ServiceManager::send(const std::string& text) const {
  return socket_ >= 0 && sendto(socket_, text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                                reinterpret_cast<const sockaddr*>(&address_), address_size_) >= 0;
}

/// A server process before this one may have ended after loop_ended(): this one is watched again.
std::string ServiceManager::ready_text() const {
  if (watchdog_ == Clock::duration::zero()) return "READY=1";
  const auto timeout = std::chrono::duration_cast<std::chrono::microseconds>(watchdog_);
  return "READY=1\nWATCHDOG_USEC=" + std::to_string(timeout.count());
}

void ServiceManager::loop_runs() {
  if (socket_ < 0) return;
  if (!ready_) ready_ = send(ready_text());
  if (watchdog_ == Clock::duration::zero()) return;
  const Clock::time_point now = Clock::now();
  if (now - fed_ >= watchdog_ / 2 && send("WATCHDOG=1")) fed_ = now;
}

void ServiceManager::loop_ended() { (void)send("WATCHDOG_USEC=0"); }

void ServiceManager::stopping() { (void)send("STOPPING=1"); }

void ServiceManager::status(const std::string& text) {
  std::string line = "STATUS=" + text;
  std::replace(line.begin(), line.end(), '\n', ' ');  // a line break would begin another variable
  (void)send(line);
}

}  // namespace parhelion::tools
