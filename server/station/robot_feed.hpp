// What pages are shown of one trainee's robot: a page follows one of them (Subscription::robot).
#pragma once

#include <optional>
#include <string>

#include "protocols/codec.hpp"
#include "server/station/scan_frames.hpp"
#include "server/station/score_board.hpp"
#include "server/station/sensor_watch.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::station {

struct RobotFeed {
  /// `robot`: its index in the configuration, which must outlive this.
  RobotFeed(const tick::Configuration& configuration, std::size_t robot);

  /// Another session begins.
  void restart();
  void take(PoseEstimate estimate);
  /// False: the event changes nothing. Of several graded robots only this one's grading counts.
  bool take(const Event& event);

  std::string name;
  std::string graded;  ///< of several graded robots the one whose score it shows; empty: one is graded
  SensorWatch sensors;
  ScoreBoard board;
  RobotPlace place;
  std::optional<Scan> augmented_scan;  ///< MR_SCAN that waits for its MR_SCAN_INFO
  ScanInfo info;
  PoseEstimate pose;
  bool pose_known = false;
  std::optional<Joints> joints;
  std::optional<HazardReading> hazard;
  WallTime picture_due;  ///< pictures before are not looked at for what is in sight
  bool score_changed = false, injection_changed = false, pose_changed = false;

  /// Its newest scan was not augmented.
  bool injection_suspended() const { return info.stamp.ns != 0 && !info.live; }
};

}  // namespace parhelion::station
