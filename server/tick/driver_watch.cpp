#include "server/tick/driver_watch.hpp"

#include <cmath>

#include "server/simulation/virtual_contact.hpp"

namespace parhelion::tick {
namespace {

/// Seven turns of the change within it are twelve a second. A stick that is shaken or a key that is hit as
/// fast as one can makes ten; two consoles that send 20 commands a second make forty, and at 10 and 20 a
/// second still twenty.
constexpr Duration kWindow = milliseconds(500);
constexpr Duration kContested = seconds(2.0);  // four messages of a console
constexpr double kChange = 0.1;  // m/s of the footprint's fastest point: more than the noise of a stick

double product(const Twist2& a, const Twist2& b) { return a.vx * b.vx + a.vy * b.vy + a.wz * b.wz; }

}  // namespace

void DriverWatch::add(ArrivalTime arrival, const Twist2& twist, const RobotDescription& robot) {
  if (!std::isfinite(twist.vx) || !std::isfinite(twist.vy) || !std::isfinite(twist.wz)) return;
  const Twist2 before = last_.value_or(twist);
  last_ = twist;
  const Twist2 change{twist.vx - before.vx, twist.vy - before.vy, twist.wz - before.wz};
  if (!(simulation::footprint_speed(robot, change) > kChange)) return;
  // Noise turns round as well, but does not come back to the command before the last one.
  const auto apart = [&](const Twist2& other) {
    return simulation::footprint_speed(robot,
                                       {twist.vx - other.vx, twist.vy - other.vy, twist.wz - other.wz});
  };
  const bool returned = before_last_ && 2 * apart(*before_last_) < simulation::footprint_speed(robot, change);
  before_last_ = before;
  const bool turned = returned && last_change_ && product(change, *last_change_) < 0;
  last_change_ = change;
  if (!turned) return;
  turns_[next_] = arrival;
  next_ = (next_ + 1) % kTurns;
  const ArrivalTime oldest = turns_[next_];
  if (oldest.ns != 0 && arrival - oldest <= kWindow) noticed_ = arrival;
}

bool DriverWatch::conflict(SimulationTime now) const {
  return noticed_ && now - simulation_time(*noticed_) < kWindow && contested_ &&
         now - *contested_ < kContested;
}

}  // namespace parhelion::tick
