// Where a robot and its joints were, by a log.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/frames.hpp"
#include "protocols/robot.hpp"
#include "tools/value_track.hpp"

namespace parhelion::tools {

/// Poses of POSE_COV while tracking; where there are none, of POSE. Positions of JOINT_STATE.
class LogPoses {
 public:
  /// Call with every event of the log, then finish(). False: it could not be decoded.
  bool handle(const Message& event);
  void finish();

  bool empty() const { return poses_.empty(); }
  bool has_joint(const std::string& name) const { return joints_.contains(name); }
  /// Interpolated; none: farther than Track::kFarthest from two poses.
  std::optional<Transform<Map, Base>> base_at(SensorTime t) const;
  /// Of a sensor on these joints. Error: no position of one of them at that time.
  Result<Transform<Base, Base>> turn_at(const std::vector<HeadJoint>& head, SensorTime t) const;

 private:
  Track<Transform<Map, Base>> poses_, estimates_;
  std::map<std::string, Track<double>> joints_;  // by name
};

}  // namespace parhelion::tools
