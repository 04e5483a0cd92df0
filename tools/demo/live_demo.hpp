// The recorded robot through the live server, with a base station: whoever opens its first link injects
// agents, drives virtual robots and looks at the video; a trainee and an observer have links of their own.
#pragma once

#include <functional>
#include <string>

#include "server/runtime/report.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::tools {

struct LiveDemoOptions {
  std::string log;      ///< what the robot said: a recording with poses
  std::string session;  ///< session log to write
  bool overwrite = false;
  std::string http = "127.0.0.1:0";  ///< ADDR:PORT of the base station
  std::string foxglove;              ///< ADDR:PORT of the Foxglove server; empty: none
  std::string folder;                ///< accounts of the base station, made anew; notes, saved scenarios
  Bus* bus = nullptr;                ///< outputs go out on it, too; may be absent
  std::function<void(const std::string&)> say;
  std::function<bool()> stop;
};

/// Serves until it is told to stop, or an instructor ends it. The robot drives as it did, then stands.
Result<runtime::Report> serve_demo(const tick::Configuration& configuration, const LiveDemoOptions& options);

}  // namespace parhelion::tools
