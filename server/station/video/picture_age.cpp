#include "server/station/video/picture_age.hpp"

#include <algorithm>

namespace parhelion::station {
namespace {

constexpr Duration kAhead = milliseconds(20);    // clocks synchronized by NTP agree this well
constexpr Duration kMaxFastestAge = seconds(1);  // bound on the delay of a camera's fastest picture

}  // namespace

Duration PictureAge::add(SensorTime stamp, SensorTime now, WallTime steady) {
  // The robot's clock was set, or a recording has restarted.
  if (stamp < last_) fastest_.forget();
  last_ = stamp;
  const Duration late = now - stamp;
  const Duration fastest = fastest_.add(late, steady);
  off_ = fastest < -kAhead || fastest > kMaxFastestAge ? fastest : Duration{};
  return std::max(late - off_, Duration{});
}

}  // namespace parhelion::station
