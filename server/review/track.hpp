// The path of a robot or an agent, thinned to what a map can show.
#pragma once

#include <cstddef>
#include <vector>

namespace parhelion::review {

struct TrackPoint {
  double t = 0;             ///< s
  double x = 0, y = 0;      ///< m, map frame
  double yaw = 0;           ///< rad
  double speed = 0;         ///< m/s in the plane, maximum since the previous point
  bool after_jump = false;  ///< it was repositioned: no motion between the previous point and this one
};

/// Keeps a point after enough motion or rotation since the last kept point. Beyond `max_points` points, every
/// other point is dropped and the distance doubles.
class Track {
 public:
  explicit Track(std::size_t max_points = 3000);

  void add(const TrackPoint& point);
  /// Always includes the last position.
  std::vector<TrackPoint> points() const;
  /// m, of all added points.
  double length() const { return length_; }
  void allow(std::size_t max_points);

 private:
  void thin();

  std::size_t max_points_;
  double step_ = 0.02;  ///< m
  double turn_ = 0.05;  ///< rad
  std::vector<TrackPoint> kept_;
  TrackPoint last_;
  double fastest_ = 0;  // since the last kept point
  double length_ = 0;
};

}  // namespace parhelion::review
