// How old a picture is. The camera's stamp is believed where its clock can be right; where it cannot, a
// picture is as much older than the fastest one as it came later.
#pragma once

#include "protocols/time.hpp"
#include "server/station/running_minimum.hpp"

namespace parhelion::station {

/// Not thread-safe.
class PictureAge {
 public:
  /// Of a picture with this stamp that is here `now`, on the axis of the session (a recording's own, where
  /// one is played); `steady`: for the window of the fastest.
  Duration add(SensorTime stamp, SensorTime now, WallTime steady);
  /// By which the camera's clock is taken to be behind; 0 where it can be right.
  Duration clock_off() const { return off_; }

 private:
  RunningMinimum fastest_{seconds(600)};
  SensorTime last_;
  Duration off_;
};

}  // namespace parhelion::station
