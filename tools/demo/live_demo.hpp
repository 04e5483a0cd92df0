// The recorded robot on the live server, with a base station. Its first link injects agents, drives virtual
// robots and shows the video; further links are for a trainee and an observer.
#pragma once

#include <functional>
#include <string>

#include "server/runtime/report.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::tools {

struct LiveDemoOptions {
  std::string log;      ///< input: a recording of the robot with poses
  std::string session;  ///< session log to write
  bool overwrite = false;
  std::string http = "127.0.0.1:0";  ///< ADDR:PORT of the base station
  std::string foxglove;              ///< ADDR:PORT of the Foxglove server; empty: none
  std::string folder;                ///< the base station's accounts, created anew; notes, saved scenarios
  Bus* bus = nullptr;                ///< outputs are also published on it; may be null
  std::function<void(const std::string&)> notify;
  std::function<bool()> stop;
};

/// Serves until it is stopped or an instructor ends the session. The robot drives as it was recorded, and
/// then stands still.
Result<runtime::Report> serve_demo(const tick::Configuration& configuration, const LiveDemoOptions& options);

}  // namespace parhelion::tools
