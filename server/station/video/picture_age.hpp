// Age of a picture. The camera's stamp is used if its clock is plausible. Otherwise the age is the delay in
// excess of the fastest recent picture.
#pragma once

#include "protocols/time.hpp"
#include "server/station/running_minimum.hpp"

namespace parhelion::station {

/// Not thread-safe.
class PictureAge {
 public:
  /// For a picture with this stamp that arrived at `now`, on the axis of the session (or the playback);
  /// `steady`: for the window of the minimum.
  Duration add(SensorTime stamp, SensorTime now, WallTime steady);
  /// Estimated lag of the camera's clock; 0 if the clock is plausible.
  Duration clock_off() const { return off_; }

 private:
  RunningMinimum fastest_{seconds(600)};
  SensorTime last_;
  Duration off_;
};

}  // namespace parhelion::station
