// The same server over a recorded log: same bytes each time, whatever the speed.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "protocols/status.hpp"
#include "server/runtime/report.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::tick {
struct RobotState;
}
namespace parhelion::runtime {

struct ReplayProgress {
  std::uint64_t bytes_done = 0, bytes_total = 0;
  double log_seconds = 0;
};

struct ReplayOptions {
  std::string log;  ///< an LCM log with inputs, or a session: then only its inputs are consumed
  std::optional<std::string> scenario;  ///< path; without it the session's own
  std::optional<std::string> robot;     ///< path; overrides the ROBOT channel
  std::optional<std::uint64_t> seed;    ///< overrides the scenario's
  std::string session;                  ///< where the session log goes; empty: none is written
  bool overwrite = false;
  double rate = 0;     ///< times real time; 0: as fast as it can
  Bus* bus = nullptr;  ///< outputs are published on it where given
  int threads = 2;     ///< 1: images are answered before the next input; the bytes are the same
  std::function<void(const ReplayProgress&)> progress;
  std::function<bool()> stop;                ///< asked between inputs
  std::map<std::string, std::string> notes;  ///< for the report and MR_STATUS: what is not as it looks
  /// Shown every input after it was handled: for pictures and pages.
  std::function<void(const tick::Configuration&, const Message&, const tick::RobotState&)> watch;
  std::function<void(const Image&)> watch_camera;  ///< each MR_CAMERA
};

/// Error: the log cannot be read at all, no robot description, a scenario that does not fit. A damaged log is
/// read as far as it goes, and the report says what was lost.
Result<Report> replay(const ReplayOptions& options);

}  // namespace parhelion::runtime
