#include "tests/fault/stand_in_robot.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "tests/server/tick/synthetic.hpp"

namespace parhelion::test {
namespace {

constexpr Duration kPeriod = milliseconds(50);  // of TELEOP and ODOMETRY; scans every second time
constexpr Duration kAnswerTime = seconds(1.0);  // a later answer is none
constexpr double kSpeed = 0.3;                  // m/s

}  // namespace

StandInRobot::StandInRobot(std::unique_ptr<Bus> sending, std::unique_ptr<Bus> receiving)
    : sending_(std::move(sending)),
      receiving_(std::move(receiving)),
      scan_(scan_at(0)),
      sender_([this](const std::stop_token& stop) { send(stop); }),
      receiver_([this](const std::stop_token& stop) { receive(stop); }) {}

void StandInRobot::set_link(const Link& link) {
  const std::lock_guard lock(mutex_);
  link_ = link;
}

void StandInRobot::mark() {
  const std::lock_guard lock(mutex_);
  const bool moves = record_.moves;
  record_ = {};
  record_.moves = moves;
  marked_ = runtime::steady_now();
}

StandInRobot::Record StandInRobot::record() const {
  const std::lock_guard lock(mutex_);
  return record_;
}

void StandInRobot::send(const std::stop_token& stop) {
  auto due = std::chrono::steady_clock::now();
  for (int i = 0; !stop.stop_requested(); ++i) {
    const SensorTime now{runtime::wall_now().ns + clock_ahead_ns_};
    publish(message(channel::kOdometry, 0, Odometry{now, pose_at(0).as<Odom, Base>()}));
    if (drives_)
      publish(message(channel::kTeleop, 0, TwistCommand{{runtime::wall_now().ns}, {kSpeed, 0, 0}}));
    if (i % 2 == 0) {
      Scan scan = scan_;
      scan.stamp = SensorTime::from_utime(now.utime());
      {
        const std::lock_guard lock(mutex_);
        waiting_[scan.stamp.utime()] = runtime::steady_now();
        ++record_.sent;
      }
      publish(message(channel::kScan, 0, scan));
      PoseEstimate pose;
      pose.stamp = scan.stamp;
      pose.T_map_base = pose_at(0);
      pose.covariance = PoseCovariance::Identity() * 1e-4;
      pose.map_id = "synthetic";
      pose.state = SlamState::tracking;
      publish(message(channel::kPoseCov, 0, pose));
    }
    due += std::chrono::nanoseconds(kPeriod.ns);
    std::this_thread::sleep_until(due);
  }
}

void StandInRobot::publish(const Message& message) {
  std::vector<Message> out;
  {
    const std::lock_guard lock(mutex_);
    const auto happens = [&](double probability) {
      return std::uniform_real_distribution<>(0, 1)(random_) < probability;
    };
    if (!happens(link_.lost)) out.push_back(message);
    if (!out.empty() && happens(link_.repeated)) out.push_back(message);
    if (delayed_) out.push_back(*std::exchange(delayed_, std::nullopt));
    if (!out.empty() && happens(link_.delayed)) {
      delayed_ = out.front();
      out.erase(out.begin());
    }
  }
  for (const Message& each : out) (void)sending_->publish(each.channel, each.payload);
}

void StandInRobot::receive(const std::stop_token& stop) {
  Message message;
  while (!stop.stop_requested()) {
    const auto came = receiving_->receive(message, milliseconds(10));
    if (came && *came) take(message);
    const std::lock_guard lock(mutex_);
    if (record_.moves && runtime::steady_now() - last_command_ > kWatchdog) command(0, true);
  }
}

void StandInRobot::take(const Message& message) {
  const std::lock_guard lock(mutex_);
  TwistCommand twist;
  Scan scan;
  if (message.channel == channel::kMrCmd && decode(message.channel, message.payload, twist)) {
    last_command_ = runtime::steady_now();
    command(std::hypot(twist.twist.vx, twist.twist.vy), false);
  } else if (message.channel == channel::kMrScan && decode(message.channel, message.payload, scan)) {
    const auto sent = waiting_.find(scan.stamp.utime());
    if (sent == waiting_.end()) return;
    if (runtime::steady_now() - sent->second < kAnswerTime) ++record_.answered;
    if (sent->second - marked_ > milliseconds(100) && !record_.answered_again)
      record_.answered_again = runtime::steady_now();
    waiting_.erase(waiting_.begin(), std::next(sent));
  }
}

/// With mutex_ locked.
void StandInRobot::command(double speed, bool by_watchdog) {
  record_.fastest = std::max(record_.fastest, speed);
  if (speed == 0 && record_.moves && !record_.stopped) {
    record_.stopped = runtime::steady_now();
    record_.by_watchdog = by_watchdog;
  }
  record_.moves = speed > 0;
}

}  // namespace parhelion::test
