// What `serve` reports to the service manager that started it (systemd), by the protocol of sd_notify(3).
#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <chrono>
#include <string>

#include "protocols/status.hpp"

namespace parhelion::tools {

/// Without NOTIFY_SOCKET in the environment, nothing is reported. No call waits: the loop reports here, and a
/// message that finds the manager's queue full is sent again in the next round.
class ServiceManager {
 public:
  /// For the process that the manager started; the server processes that it forks report through it too.
  /// Error: a variable of the environment is malformed.
  static Result<ServiceManager> from_environment();

  ServiceManager() = default;
  ServiceManager(ServiceManager&& other) noexcept;
  ServiceManager& operator=(ServiceManager&&) = delete;
  ~ServiceManager();

  /// To be called by the loop in each round: READY=1 the first time, then WATCHDOG=1 at half of the manager's
  /// timeout.
  void loop_runs();
  /// The loop has ended, the process has not: from here on the manager expects no WATCHDOG=1.
  void loop_ended();
  void stopping();
  /// One line about the state of the service. Every user of the machine can read it: no secrets.
  void status(const std::string& text);

 private:
  using Clock = std::chrono::steady_clock;

  /// False: not sent.
  bool send(const std::string& text) const;
  std::string ready_text() const;

  int socket_ = -1;  // -1: no manager
  sockaddr_un address_{};
  socklen_t address_size_ = 0;
  Clock::duration watchdog_{};  // 0: the manager expects no WATCHDOG=1
  Clock::time_point fed_;
  bool ready_ = false;
};

}  // namespace parhelion::tools
