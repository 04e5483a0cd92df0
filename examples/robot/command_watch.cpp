#include "command_watch.hpp"

#include <algorithm>
#include <cstdlib>

namespace robot {

bool CommandWatch::Sender::follows(std::int64_t next, std::int64_t now) const {
  return next > utime && std::llabs(now - next - offset) <= kLateness;
}

void CommandWatch::Sender::add(std::int64_t next, std::int64_t now) {
  utime = next;
  offset = std::min(offset, now - next);
  ++commands;
}

// Messages of a queue that is emptied at once, and a message that is repeated, are never new: their stamps do
// not keep up with the robot's clock, or do not advance.
bool CommandWatch::is_new(std::int64_t utime, std::int64_t now) {
  const Sender first{utime, now - utime};
  if (!sender_) {
    sender_ = first;
    return true;
  }
  if (sender_->follows(utime, now)) {
    sender_->add(utime, now);
    candidate_.reset();
    return true;
  }
  if (candidate_ && candidate_->follows(utime, now))
    candidate_->add(utime, now);
  else
    candidate_ = first;
  if (candidate_->commands < kConfirm) return false;
  sender_ = candidate_;
  candidate_.reset();
  return true;
}

bool CommandWatch::receive(const Twist2& command, std::int64_t utime, std::int64_t now) {
  if (!std::isfinite(command.vx) || !std::isfinite(command.wz)) return receive({}, utime, now);
  const bool is_motion = command.vx != 0 || command.wz != 0;
  if (is_motion && !is_new(utime, now)) return false;
  command_ = command;
  received_ = now;
  return true;
}

Twist2 CommandWatch::command(std::int64_t now) const {
  return now - received_ > kSilence ? Twist2{} : command_;
}

bool CommandWatch::is_stopped(std::int64_t now) const {
  return now - received_ <= kSilence && command_.vx == 0 && command_.wz == 0;
}

}  // namespace robot
