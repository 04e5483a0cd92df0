// The way that a robot or an agent went, thinned to what a map can show.
#pragma once

#include <cstddef>
#include <vector>

namespace parhelion::review {

struct TrackPoint {
  double t = 0;             ///< s
  double x = 0, y = 0;      ///< m, map frame
  double yaw = 0;           ///< rad
  double speed = 0;         ///< m/s in the plane, the greatest since the point before
  bool after_jump = false;  ///< it was put here: nothing lies between the point before and this one
};

/// Keeps a point where it has moved or turned enough since the last, at most `most`: then only every other
/// one of those that are there, and from then on at twice the distance.
class Track {
 public:
  explicit Track(std::size_t most = 3000);

  void add(const TrackPoint& point);
  /// The last place is among them even where it is near the one before.
  std::vector<TrackPoint> points() const;
  /// m, of all that was added.
  double length() const { return length_; }
  void allow(std::size_t most);

 private:
  void thin();

  std::size_t most_;
  double step_ = 0.02;  ///< m
  double turn_ = 0.05;  ///< rad
  std::vector<TrackPoint> kept_;
  TrackPoint last_;
  double fastest_ = 0;  // since the last kept
  double length_ = 0;
};

}  // namespace parhelion::review
