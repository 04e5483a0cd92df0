#include "server/station/video/video_link.hpp"

#include <algorithm>

namespace parhelion::station {
namespace {

constexpr std::size_t kMaxInFlight = 256;      // frames; older ones are forgotten
constexpr Duration kLate = milliseconds(120);  // beyond the minimum: a queue is growing
constexpr Duration kMuchTooLate = milliseconds(400);
constexpr Duration kDownPeriod = milliseconds(400);            // time until a lower rate takes effect
constexpr Duration kUpPeriod = seconds(2.0);                   // without delay before a higher rate is tried
constexpr Duration kGivenUp = seconds(3.0);                    // without an acknowledgement: start again
constexpr double kWaitingTime = 0.15, kMuchWaitingTime = 0.5;  // s of the bit rate

}  // namespace

void VideoLink::sent(std::uint32_t sequence, WallTime now) {
  in_flight_.push_back({sequence, now});
  if (in_flight_.size() > kMaxInFlight) in_flight_.pop_front();
}

void VideoLink::acknowledged(std::uint32_t sequence, WallTime now) {
  while (!in_flight_.empty() && in_flight_.front().sequence <= sequence) {
    const Sent& frame = in_flight_.front();
    last_acknowledged_ = now;
    if (frame.sequence == sequence) round_trip_ = fastest_.add(now - frame.at, now);
    in_flight_.pop_front();
  }
}

Duration VideoLink::overdue(WallTime now) const {
  if (!round_trip_ || in_flight_.empty()) return {};
  return now - in_flight_.front().at - *round_trip_;
}

void VideoLink::look(std::size_t waiting, WallTime now) {
  const double queued = static_cast<double>(waiting) * 8 / bit_rate_;  // s
  const Duration beyond = overdue(now);
  congested_ = queued > kWaitingTime || beyond > kLate;
  const bool far_behind = queued > kMuchWaitingTime || beyond > kMuchTooLate;
  lags_ = far_behind || (lags_ && congested_);
  if (lags_ && queued <= kWaitingTime && last_acknowledged_ && now - *last_acknowledged_ >= kGivenUp) {
    in_flight_.clear();
    last_acknowledged_ = now;
    lags_ = congested_ = false;
  }
  follow(now);
}

void VideoLink::follow(WallTime now) {
  if (!changed_) changed_ = now;
  const Duration since = now - *changed_;
  if (congested_ && since >= kDownPeriod) {
    bit_rate_ = std::max(limits_.floor, static_cast<int>(bit_rate_ * (lags_ ? 0.5 : 0.7)));
    changed_ = now;
  } else if (congested_ && bit_rate_ == limits_.floor) {
    changed_ = now;
  } else if (!congested_ && since >= kUpPeriod) {
    bit_rate_ = std::min(limits_.ceiling, static_cast<int>(bit_rate_ * 1.15));
    changed_ = now;
  }
}

}  // namespace parhelion::station
