// What the command that runs the session lets pages do with it.
#pragma once

#include <functional>
#include <string>

#include "protocols/status.hpp"

namespace parhelion::station {

struct ControlState {
  bool recorded = false;
  bool paused = false;
  double rate = 1;       ///< times real time
  double position = -1;  ///< s of the session; below 0: as the server's clock has it
  double duration = -1;  ///< s; below 0: it is not known how long it will be
  bool ended = false;
  bool frozen = false;  ///< all agents stand still by the instructor's word
  bool estop = false;
};

/// Each may be empty: then it cannot be done, and pages are told so. Called on the station's thread; none may
/// block for long. Errors say why not ("a real robot cannot be paused").
struct SessionControls {
  std::function<Status(bool paused)> pause;
  std::function<Status(double rate)> rate;      ///< times real time
  std::function<Status(double position)> seek;  ///< s of the session
  std::function<Status()> step;                 ///< one message on, while paused
  std::function<Status()> end;                  ///< ends and grades
  /// How it stands; `frozen` is the station's to say. Empty: a live session that goes on.
  std::function<ControlState()> state;
  /// Of a recording: a JSON list [{t, kind, text, bad}] of what is marked on the seek bar. Asked for once.
  std::function<std::string()> marks;
};

}  // namespace parhelion::station
