// The main job on a packaged real recording, no robot needed: what `parhelion demo` does.
#pragma once

#include <functional>
#include <string>

#include "protocols/bus/bus.hpp"
#include "protocols/status.hpp"
#include "server/runtime/report.hpp"

namespace parhelion::tools {

struct DemoOptions {
  std::string recording;                  ///< rawlog; empty: the SENA recording of Debian's mrpt-common
  std::string folder = "parhelion-demo";  ///< where logs, map, model, scenario and pictures go
  std::string session;                    ///< session log; empty: session.lcm in the folder
  bool overwrite = false;
  bool fast = false;     ///< as fast as it can instead of at real speed; not with `http`
  std::string http;      ///< ADDR:PORT of a base station, and the robot drives live; empty: a replay, no page
  std::string foxglove;  ///< ADDR:PORT of a Foxglove server beside it; empty: none
  Bus* bus = nullptr;    ///< outputs go out on it
  std::function<void(const std::string&)> say;  ///< a line a step
  std::function<void(const std::string& task, double done, double total)> progress;
  std::function<bool()> stop;
};

struct DemoResult {
  runtime::Report report;
  std::string session, map_picture, camera_picture;  ///< paths; camera_picture empty where no agent was seen
  std::string camera;                                ///< what CAMERA was, or why there was none
};

Result<DemoResult> run_demo(const DemoOptions& options);

}  // namespace parhelion::tools
