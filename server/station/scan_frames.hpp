// Scans for pages: the pose of the laser at the stamp, and which beams are virtual.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "fusion/pose/pose_track.hpp"
#include "protocols/codec.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::station {

/// Content of binary message 2 besides the scan itself.
struct ScanFrame {
  enum class Source : std::uint8_t { real, augmented, agent };
  Source source = Source::real;
  std::uint16_t part = 0xFFFF;                       ///< of an agent: index of its first part in the entity
                                                     ///< table
  double t = 0;                                      ///< s of the session
  std::optional<Transform<Map, Laser>> T_map_laser;  ///< at the stamp; none: unknown, sent as NaN
  std::vector<std::int16_t> entities;                ///< for each beam: index of the entity hit, -1: real; or
                                                     ///< empty
};
std::string scan_bytes(const Scan& scan, const ScanFrame& frame);

/// Pose of a trainee's robot at any instant of its clock, as the server estimates it.
class RobotPlace {
 public:
  /// `robot`: its index in the configuration, which must outlive this.
  RobotPlace(const tick::Configuration& configuration, std::size_t robot);

  void take(const Odometry& odometry) { track_->add(odometry); }
  void take(PoseEstimate estimate);
  /// POSE, if the scenario gives its accuracy.
  void take(const PoseStamped& pose);
  std::optional<Transform<Map, Laser>> laser_at(SensorTime t) const;
  /// In the plane: roll and pitch are unknown.
  std::optional<Transform<Map, Base>> base_at(SensorTime t) const;
  void restart();

 private:
  const tick::Configuration& configuration_;
  const RobotDescription& robot_;
  std::optional<pose::PoseTrack> track_;
};

/// Poses of agents at a recent instant, from the newest two worlds.
class AgentPlaces {
 public:
  void take(const WorldMessage& world);
  /// The laser of an agent, mounted at `T_base_laser`.
  std::optional<Transform<Map, Laser>> laser_at(const std::string& agent,
                                                const Transform<Base, Laser>& T_base_laser,
                                                SimulationTime t) const;
  void restart() { worlds_[0].bodies.clear(), worlds_[1].bodies.clear(); }

 private:
  WorldMessage worlds_[2];  ///< older first
};

}  // namespace parhelion::station
