#include "server/station/video/video_link.hpp"

#include <algorithm>

namespace parhelion::station {
namespace {

constexpr std::size_t most_on_their_way = 256;  // frames; older ones are forgotten
constexpr Duration late = milliseconds(120);    // beyond the minimum: a queue is growing
constexpr Duration much_too_late = milliseconds(400);
constexpr Duration down_period = milliseconds(400);             // time until a lower rate takes effect
constexpr Duration up_period = seconds(2.0);                    // without delay before a higher rate is tried
constexpr Duration given_up = seconds(3.0);                     // without an acknowledgement: start again
constexpr double waiting_time = 0.15, much_waiting_time = 0.5;  // s of the bit rate

}  // namespace

void VideoLink::sent(std::uint32_t sequence, WallTime now) {
  on_their_way_.push_back({sequence, now});
  if (on_their_way_.size() > most_on_their_way) on_their_way_.pop_front();
}

void VideoLink::acknowledged(std::uint32_t sequence, WallTime now) {
  while (!on_their_way_.empty() && on_their_way_.front().sequence <= sequence) {
    const Sent& frame = on_their_way_.front();
    heard_ = now;
    if (frame.sequence == sequence) round_trip_ = fastest_.add(now - frame.at, now);
    on_their_way_.pop_front();
  }
}

Duration VideoLink::overdue(WallTime now) const {
  if (!round_trip_ || on_their_way_.empty()) return {};
  return now - on_their_way_.front().at - *round_trip_;
}

void VideoLink::look(std::size_t waiting, WallTime now) {
  const double queued = static_cast<double>(waiting) * 8 / bit_rate_;  // s
  const Duration beyond = overdue(now);
  congested_ = queued > waiting_time || beyond > late;
  const bool far_behind = queued > much_waiting_time || beyond > much_too_late;
  lags_ = far_behind || (lags_ && congested_);
  if (lags_ && queued <= waiting_time && heard_ && now - *heard_ >= given_up) {
    on_their_way_.clear();
    heard_ = now;
    lags_ = congested_ = false;
  }
  follow(now);
}

void VideoLink::follow(WallTime now) {
  if (!changed_) changed_ = now;
  const Duration since = now - *changed_;
  if (congested_ && since >= down_period) {
    bit_rate_ = std::max(limits_.floor, static_cast<int>(bit_rate_ * (lags_ ? 0.5 : 0.7)));
    changed_ = now;
  } else if (congested_ && bit_rate_ == limits_.floor) {
    changed_ = now;
  } else if (!congested_ && since >= up_period) {
    bit_rate_ = std::min(limits_.most, static_cast<int>(bit_rate_ * 1.15));
    changed_ = now;
  }
}

}  // namespace parhelion::station
