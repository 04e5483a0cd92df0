// Plays a recording as a live robot: its messages with current stamps. After the end of the recording the
// robot stands still and keeps publishing its last state.
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
  /// `speaks`: true for the robot's own channels. `start`: time of its first message. `pace`: the channel of
  /// its main sensor, whose rate it keeps at standstill. Error: no such log, or fewer than two messages on
  /// `pace`.
  static Result<RecordedRobot> open(const std::string& log, std::function<bool(const std::string&)> speaks,
                                    const std::string& pace, ArrivalTime start);

  /// The next message; the stream never ends. `arrival` is its publication time; the stamp in it is shifted
  /// by the same amount. Error: the log cannot be read.
  Result<Message> next();
  bool stands() const { return standing_ > 0; }
  std::size_t passed_over() const { return passed_over_; }  ///< messages too short to contain a stamp

 private:
  explicit RecordedRobot(LogReader log) : log_(std::move(log)) {}
  Result<bool> next_recorded(Message& message);
  Message stand();

  LogReader log_;
  std::function<bool(const std::string&)> speaks_;
  Duration ahead_;                         ///< offset of now from the recording
  Duration period_;                        ///< of the main sensor
  std::map<std::string, Message> newest_;  ///< by channel, as recorded
  std::vector<Message> last_;              ///< those, in the order of their arrival
  std::size_t standing_ = 0;               ///< messages said since
  std::size_t passed_over_ = 0;
};

}  // namespace parhelion::tools
