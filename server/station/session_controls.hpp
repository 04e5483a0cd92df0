// What pages may do with the command that runs the session.
#pragma once

#include <functional>
#include <string>

#include "protocols/status.hpp"

namespace parhelion::station {

struct ControlState {
  bool recorded = false;
  bool paused = false;
  double rate = 1;       ///< times real time
  double position = -1;  ///< s of the session; below 0: as by the server's clock
  double duration = -1;  ///< s; below 0: unknown
  bool ended = false;
  bool frozen = false;  ///< the instructor has frozen all agents
  bool estop = false;
  double clock = 0;  ///< s, the server's monotonic clock when the station looked at it last
};

/// An empty function means that the control is not available, and pages are informed. Called on the station's
/// thread; none may block for long. The error contains the reason ("a real robot cannot be paused").
struct SessionControls {
  std::function<Status(bool paused)> pause;
  std::function<Status(double rate)> rate;      ///< times real time
  std::function<Status(double position)> seek;  ///< s of the session
  std::function<Status()> step;                 ///< the next message, while paused
  std::function<Status()> end;                  ///< ends and grades the session
  /// Current state; the station fills in `frozen`. Empty: a running live session.
  std::function<ControlState()> state;
  /// Of a recording: a JSON list [{t, kind, text, bad}] of marks on the seek bar. Called once.
  std::function<std::string()> marks;
};

}  // namespace parhelion::station
