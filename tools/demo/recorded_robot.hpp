// A robot out of a recording, as if it drove now: what it said, with the stamps of now. When the recording is
// over it stands where it is, and goes on saying so.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/bus/log_file.hpp"
#include "protocols/status.hpp"

namespace parhelion::tools {

class RecordedRobot {
 public:
  /// `speaks`: whether a channel is one of the robot's own. `start`: when its first message comes. `pace`:
  /// the channel of its main sensor, at whose rate it goes on when it stands. Error: no such log, or fewer
  /// than two messages on `pace`.
  static Result<RecordedRobot> open(const std::string& log, std::function<bool(const std::string&)> speaks,
                                    const std::string& pace, ArrivalTime start);

  /// The next message, without an end; `arrival` is when it is to be said, and the stamp in it has been moved
  /// as far. Error: the log cannot be read on.
  Result<Message> next();
  bool stands() const { return standing_ > 0; }
  std::size_t passed_over() const { return passed_over_; }  ///< messages too short to have a stamp

 private:
  explicit RecordedRobot(LogReader log) : log_(std::move(log)) {}
  Result<bool> next_recorded(Message& message);
  Message stand();

  LogReader log_;
  std::function<bool(const std::string&)> speaks_;
  Duration ahead_;                         ///< of now before the recording
  Duration period_;                        ///< of the main sensor
  std::map<std::string, Message> newest_;  ///< by channel, as recorded
  std::vector<Message> last_;              ///< those, in the order of their arrival
  std::size_t standing_ = 0;               ///< messages said since
  std::size_t passed_over_ = 0;
};

}  // namespace parhelion::tools
