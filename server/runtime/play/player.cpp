#include "server/runtime/play/player.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace parhelion::runtime {
namespace {

constexpr Duration kMaxIdle = milliseconds(50);
constexpr std::size_t kBatch = 500;  // messages per turn, so that a pause takes effect at a high rate

}  // namespace

Player::Player(Recording recording, const PlayOptions& options, std::function<void(const Message&)> send)
    : recording_(std::move(recording)),
      loop_(options.loop),
      send_(std::move(send)),
      paused_(options.paused),
      rate_(options.rate),
      wanted_(options.start) {}

Status Player::send(std::size_t i) {
  if (const Status read = recording_.read(i, message_); !read) {
    next_ = recording_.size();
    ended_ = true;
    return read;
  }
  send_(message_);
  return {};
}

Status Player::jump(double position) {
  const std::size_t to = std::max<std::size_t>(1, recording_.count_until(position));
  const std::size_t from = to < next_ ? 0 : next_;
  position_ = position;
  ended_ = false;
  for (const std::size_t i : recording_.news(from, to)) {
    if (const Status sent = send(i); !sent) return sent;
  }
  next_ = to;
  return {};
}

/// Advances the position, at the rate.
void Player::move_to(WallTime now) {
  if (paused_ || ended_) {
    at_.reset();
    return;
  }
  if (at_) position_ += rate_ * std::max(0.0, (now - *at_).seconds());
  at_ = now;
}

Result<Duration> Player::turn(WallTime now) {
  const std::lock_guard lock(mutex_);
  move_to(now);
  if (wanted_) {
    if (const Status jumped = jump(*std::exchange(wanted_, std::nullopt)); !jumped) return jumped.error();
    at_ = now;
  }
  for (; steps_ > 0 && next_ < recording_.size(); --steps_) {
    position_ = recording_.t(next_);
    if (const Status sent = send(next_++); !sent) return sent.error();
  }
  steps_ = 0;
  if (paused_) return kMaxIdle;
  for (std::size_t sent = 0; next_ < recording_.size() && recording_.t(next_) <= position_; ++sent) {
    if (sent == kBatch) return Duration{};
    if (const Status done = send(next_++); !done) return done.error();
  }
  if (next_ < recording_.size()) {
    const Duration left = seconds((recording_.t(next_) - position_) / rate_);
    return std::min(left, kMaxIdle);
  }
  position_ = recording_.duration();
  if (loop_ && !ended_) {
    wanted_ = 0;
    return Duration{};
  }
  ended_ = true;
  return kMaxIdle;
}

void Player::pause(bool paused) {
  const std::lock_guard lock(mutex_);
  paused_ = paused;
  if (paused_) at_.reset();
}

Status Player::set_rate(double rate) {
  if (!(rate >= kSlowest && rate <= kFastest))
    return Error{"a rate of " + std::to_string(rate) + "; expected 0.01 to 100 times real time"};
  const std::lock_guard lock(mutex_);
  rate_ = rate;
  return {};
}

Status Player::seek(double position) {
  if (!std::isfinite(position)) return Error{"the position to seek is not a number; expected seconds"};
  const std::lock_guard lock(mutex_);
  wanted_ = std::clamp(position, 0.0, recording_.duration());
  return {};
}

Status Player::step() {
  const std::lock_guard lock(mutex_);
  if (!paused_) return Error{"it is playing; pause it to step through its messages"};
  ++steps_;
  return {};
}

PlayState Player::state() const {
  const std::lock_guard lock(mutex_);
  const double position = wanted_.value_or(position_);
  return {paused_, ended_ && !wanted_, rate_, std::clamp(position, 0.0, recording_.duration()),
          recording_.duration()};
}

ArrivalTime Player::clock() const { return recording_.arrival_at(state().position); }

}  // namespace parhelion::runtime
