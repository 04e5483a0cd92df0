#include "server/review/track.hpp"

#include <algorithm>
#include <cmath>

#include "protocols/frames.hpp"

namespace parhelion::review {

Track::Track(std::size_t max_points) : max_points_(std::max<std::size_t>(max_points, 2)) {}

void Track::add(const TrackPoint& point) {
  if (!kept_.empty() && !point.after_jump) length_ += std::hypot(point.x - last_.x, point.y - last_.y);
  last_ = point;
  fastest_ = std::max(fastest_, point.speed);
  if (!kept_.empty() && !point.after_jump) {
    const TrackPoint& before = kept_.back();
    if (std::hypot(point.x - before.x, point.y - before.y) < step_ &&
        std::abs(wrap_angle(point.yaw - before.yaw)) < turn_)
      return;
  }
  kept_.push_back(point);
  kept_.back().speed = fastest_;
  fastest_ = 0;
  while (kept_.size() > max_points_) thin();
}

void Track::allow(std::size_t max_points) {
  max_points_ = std::max<std::size_t>(max_points, 2);
  while (kept_.size() > max_points_) thin();
}

void Track::thin() {
  step_ *= 2;
  turn_ *= 2;
  std::vector<TrackPoint> fewer;
  fewer.reserve(max_points_ + 1);
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    if (i % 2 == 0) {
      fewer.push_back(kept_[i]);
      if (i > 0) fewer.back().speed = std::max(kept_[i].speed, kept_[i - 1].speed);
      if (i > 0 && kept_[i - 1].after_jump) fewer.back().after_jump = true;
    }
  }
  kept_ = std::move(fewer);
}

std::vector<TrackPoint> Track::points() const {
  std::vector<TrackPoint> all = kept_;
  if (!all.empty() && last_.t > all.back().t) all.push_back(last_);
  return all;
}

}  // namespace parhelion::review
