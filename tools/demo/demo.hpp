// `parhelion demo`: the whole pipeline on a packaged real recording, without a robot.
#pragma once

#include <functional>
#include <string>

#include "fusion/pose/slam.hpp"
#include "protocols/bus/bus.hpp"
#include "protocols/status.hpp"
#include "server/runtime/report.hpp"

namespace parhelion::tools {

struct DemoOptions {
  std::string recording;                  ///< rawlog; empty: the SENA recording of Debian's mrpt-common
  std::string folder = "parhelion-demo";  ///< folder of logs, map, model, scenario and pictures
  std::string session;                    ///< session log; empty: session.lcm in the folder
  bool overwrite = false;
  /// Maps, and localizes; an engine that does only one of both leaves the other to Parhelion's (mapping) or
  /// to MRPT's Monte Carlo localization.
  pose::SlamEngine engine = pose::SlamEngine::parhelion;
  bool fast = false;     ///< as fast as possible instead of in real time; not with `http`
  std::string http;      ///< ADDR:PORT of a base station, with the robot live; empty: a replay without pages
  std::string foxglove;  ///< ADDR:PORT of an additional Foxglove server; empty: none
  Bus* bus = nullptr;    ///< outputs are published on it
  std::function<void(const std::string&)> notify;  ///< one line for each step
  std::function<void(const std::string& task, double done, double total)> progress;
  std::function<bool()> stop;
};

struct DemoResult {
  runtime::Report report;
  std::string session, map_picture, camera_picture;  ///< paths; camera_picture is empty if no agent was
                                                     ///< visible
  std::string camera;                                ///< the source of CAMERA, or the reason why there was
                                                     ///< none
};

Result<DemoResult> run_demo(const DemoOptions& options);

}  // namespace parhelion::tools
