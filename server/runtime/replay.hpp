// Runs the server over a recorded log: the same bytes each time, at any speed.
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
  std::optional<std::string> scenario;  ///< path; otherwise the session's own
  std::optional<std::string> robot;     ///< path; overrides the ROBOT channel
  std::optional<std::uint64_t> seed;    ///< overrides the scenario's
  /// Path of the texture that simulated cameras show. A session log does not contain it: without it a
  /// replay draws the building in the colours of its labels. With a scenario, the one beside its model.
  std::optional<std::string> texture;
  std::string session;  ///< path of the session log to write; empty: none
  bool overwrite = false;
  double rate = 0;     ///< times real time; 0: as fast as possible
  Bus* bus = nullptr;  ///< publishes the outputs if given
  int threads = 2;     ///< 1: images are rendered before the next input; the bytes are the same
  std::function<void(const ReplayProgress&)> progress;
  std::function<bool()> stop;  ///< polled between inputs
  std::map<std::string, std::string>
      notes;  ///< for the report and MR_STATUS: anything unusual about this run
  /// Called with every input after it was handled: for pictures and pages.
  std::function<void(const tick::Configuration&, const Message&, const tick::RobotState&)> watch;
  std::function<void(const Image&)> watch_camera;  ///< each MR_CAMERA
};

/// Error: an unreadable log, no robot description, or a scenario that does not fit. A damaged log is read as
/// far as possible, and the report gives the loss.
Result<Report> replay(const ReplayOptions& options);

}  // namespace parhelion::runtime
