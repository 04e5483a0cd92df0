#include "server/station/video/video_source.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "protocols/splitmix64.hpp"

namespace parhelion::station {
namespace {

constexpr Duration kMissing = milliseconds(500);  // without a picture: the camera's own is shown
constexpr Duration kStaleAfter = milliseconds(500), kLongestWait = seconds(3.0);
constexpr int kPeriods = 3;  // periods of a slow camera until its picture is stale

std::string text_of(const ImageMetadata& entry) { return {entry.value.begin(), entry.value.end()}; }

/// Uniform in [0, 1), the same for the same count.
double random_fraction(std::uint64_t count) {
  return unit_interval(splitmix64(count * kSplitMix64Increment));
}

}  // namespace

VideoSource::VideoSource(std::string robot, std::string channel, std::string original, bool simulated)
    : robot_(std::move(robot)),
      channel_(std::move(channel)),
      original_(std::move(original)),
      simulated_(simulated) {}

bool VideoSource::accepts(const std::string& channel, WallTime now) {
  if (channel == channel_) {
    last_message_ = now;
    return true;
  }
  return !original_.empty() && channel == original_ && (!last_message_ || now - *last_message_ >= kMissing);
}

bool VideoSource::is_lost(double fraction) { return random_fraction(++counted_) < fraction; }

std::optional<VideoSource::Waiting> VideoSource::take_due(WallTime now) {
  std::optional<Waiting> newest;
  while (!waiting.empty() && waiting.front().due <= now) {
    newest = std::move(waiting.front());
    waiting.pop_front();
  }
  return newest;
}

VideoFrame VideoSource::shown(const Waiting& picture, SensorTime session, SensorTime wall, WallTime now) {
  const ImageMetadata* reason = picture.image.find_metadata("parhelion.reason");
  VideoFrame frame;
  frame.state = picture.original || reason != nullptr                              ? PictureState::original
                : simulated_ || picture.image.find_metadata("stand-in") != nullptr ? PictureState::simulated
                                                                                   : PictureState::live;
  why_ = reason != nullptr ? text_of(*reason)
         : picture.original
             ? "the server sends no pictures: this is the camera's own, without virtual objects"
             : "";
  frame.sequence = ++sequence_;
  const Duration age = age_.add(picture.image.stamp, session, now);
  frame.stamp_us = (wall - age).utime();
  frame.server_us = wall.utime();
  frame.drawn_us = picture.arrived.utime();
  if (shown_) period_ = now - *shown_;
  shown_ = now;
  fault.clear();
  return frame;
}

VideoStatus VideoSource::status(WallTime now) const {
  VideoStatus status;
  status.clock_off_s = std::round(age_.clock_off().seconds() * 10) / 10;
  status.why = fault.empty() ? why_ : fault;
  if (!shown_) {
    status.state = VideoStatus::State::none;
    if (fault.empty()) status.why = "no picture on " + channel_ + " yet";
    return status;
  }
  const Duration allowed = std::clamp(Duration{kPeriods * period_.ns}, kStaleAfter, kLongestWait);
  status.state = now - *shown_ < allowed ? VideoStatus::State::live : VideoStatus::State::stale;
  if (status.state == VideoStatus::State::stale && fault.empty())
    status.why = "no picture on " + channel_ + " any more";
  return status;
}

}  // namespace parhelion::station
