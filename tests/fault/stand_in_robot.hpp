// A robot and its trainee, for a live server: they send scans and commands, and record what comes back.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/scan.hpp"
#include "server/runtime/wall_clock.hpp"

namespace parhelion::test {

/// What the robot's link does to messages, each with this probability.
struct Link {
  double lost = 0, repeated = 0, delayed = 0;  ///< delayed: until after the next message
};

/// Stands in a room, and "moves" as MR_CMD says. Its watchdog stops it after 0.3 s without MR_CMD.
class StandInRobot {
 public:
  static constexpr Duration kWatchdog = milliseconds(300);

  StandInRobot(std::unique_ptr<Bus> sending, std::unique_ptr<Bus> receiving);

  void drive(bool drives) { drives_ = drives; }
  void set_link(const Link& link);
  /// Of the robot's own clock against the true time.
  void set_clock(Duration ahead) { clock_ahead_ns_ = ahead.ns; }

  struct Record {
    int sent = 0, answered = 0;              ///< scans
    std::optional<WallTime> stopped;         ///< first stop since the mark
    bool by_watchdog = false;                ///< that stop
    std::optional<WallTime> answered_again;  ///< first answer to a scan sent 0.1 s or more after the mark
    double fastest = 0;                      ///< m/s, largest commanded speed since the mark
    bool moves = false;                      ///< now
  };
  /// Starts a new record.
  void mark();
  Record record() const;

 private:
  void send(const std::stop_token& stop);
  void receive(const std::stop_token& stop);
  void publish(const Message& message);
  void take(const Message& message);
  void command(double speed, bool by_watchdog);

  const std::unique_ptr<Bus> sending_, receiving_;
  const Scan scan_;
  std::atomic<bool> drives_ = false;
  std::atomic<std::int64_t> clock_ahead_ns_ = 0;

  mutable std::mutex mutex_;
  Link link_;
  std::mt19937 random_{1};
  std::optional<Message> delayed_;
  Record record_;
  WallTime marked_, last_command_;
  std::map<std::int64_t, WallTime> waiting_;  ///< scans by utime, with the time of sending
  std::jthread sender_, receiver_;
};

}  // namespace parhelion::test
