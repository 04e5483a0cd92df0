#include "server/station/video/picture_age.hpp"

#include <algorithm>

namespace parhelion::station {
namespace {

constexpr Duration ahead = milliseconds(20);  // of two clocks that agree as well as NTP makes them
constexpr Duration slowest_way = seconds(1);  // no camera's fastest picture takes longer

}  // namespace

Duration PictureAge::add(SensorTime stamp, SensorTime now, WallTime steady) {
  // A robot's clock was set, or a recording begins again.
  if (stamp < last_) fastest_.forget();
  last_ = stamp;
  const Duration late = now - stamp;
  const Duration fastest = fastest_.add(late, steady);
  off_ = fastest < -ahead || fastest > slowest_way ? fastest : Duration{};
  return std::max(late - off_, Duration{});
}

}  // namespace parhelion::station
