#include "server/station/teleop_client.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "protocols/driving_timing.hpp"
#include "server/station/operator_name.hpp"

namespace parhelion::station {
namespace {

constexpr int kMaxPerSecond = 300;  // messages of one page

/// Scaled as a whole, which keeps the curvature.
Twist2 within(const TeleopRobot& robot, Twist2 twist) {
  double scale = 1;
  for (auto [asked, limit] : {std::pair{&twist.vx, robot.vx}, {&twist.vy, robot.vy}, {&twist.wz, robot.wz}}) {
    if (limit <= 0) *asked = 0;
    if (std::abs(*asked) > limit && limit > 0) scale = std::min(scale, limit / std::abs(*asked));
  }
  return {scale * twist.vx, scale * twist.vy, scale * twist.wz};
}

}  // namespace

TeleopClient::TeleopClient(Bus& bus, std::shared_ptr<WebClient> client, WallTime now)
    : client_(std::move(client)),
      console_(bus, operator_name(client_->who()), "browser"),
      last_message_(now) {}

void TeleopClient::set_robots(const std::vector<TeleopRobot>& robots) {
  std::vector<DrivenRobot> driven;
  for (const TeleopRobot& robot : robots) {
    driven.push_back(robot.driven);
    if (robot.driven.name == robot_.driven.name) robot_ = robot;
  }
  console_.set_robots(std::move(driven));
  if (console_.driven() == nullptr) robot_ = {};
}

Status TeleopClient::drive(const TeleopRobot& robot, TeleopInstant now) {
  wheels_.require_release();
  arm_.require_release();
  if (robot.driven.name != robot_.driven.name) {
    if (Status stopped = send_stop(now); !stopped) return stopped;
    stop_until_ = now.steady;
    moved_joints_.clear();
  }
  robot_ = robot;
  return console_.drive(robot.driven.name, now.stamp);
}

Status TeleopClient::pass(DeadManGate& gate, const ClientStamp& stamp, TeleopInstant now, bool& passed) {
  passed = false;
  if (robot().empty()) return Error{"select a robot first: this page drives none"};
  const char* why = nullptr;
  passed = gate.pass(stamp, clock_, now.steady, why);
  if (why == nullptr) return {};
  if (Status stopped = halt(now); !stopped) return stopped;
  return Error{why};
}

Result<bool> TeleopClient::move(const ClientStamp& stamp, const Twist2& twist, TeleopInstant now) {
  bool passed = false;
  if (Status may = pass(wheels_, stamp, now, passed); !may) return may.error();
  if (!passed) return false;
  stop_until_ = now.steady;
  if (Status sent = console_.command(within(robot_, twist), now.stamp); !sent) return sent.error();
  return true;
}

Result<bool> TeleopClient::move_joints(const TeleopRequest& request, TeleopInstant now) {
  bool passed = false;
  if (Status may = pass(arm_, request.stamp, now, passed); !may) return may.error();
  if (!passed) return false;
  std::vector<double> speeds = request.velocities;
  for (std::size_t i = 0; i < speeds.size(); ++i) {
    const auto known = std::find_if(robot_.joints.begin(), robot_.joints.end(),
                                    [&](const TeleopJoint& joint) { return joint.name == request.names[i]; });
    if (known == robot_.joints.end())
      return Error{"robot '" + robot() + "' has no joint '" + request.names[i] + "'"};
    speeds[i] = std::clamp(speeds[i], -known->speed, known->speed);
  }
  if (Status sent = console_.joints(request.names, speeds, now.stamp); !sent) return sent.error();
  for (const std::string& name : request.names) {
    if (std::find(moved_joints_.begin(), moved_joints_.end(), name) == moved_joints_.end())
      moved_joints_.push_back(name);
  }
  return true;
}

Status TeleopClient::send_stop(TeleopInstant now) {
  stop_sent_ = now.steady;
  Status stopped = console_.command({}, now.stamp);
  if (moved_joints_.empty()) return stopped;
  const Status held = console_.joints(moved_joints_, std::vector<double>(moved_joints_.size(), 0), now.stamp);
  return stopped ? held : stopped;
}

Status TeleopClient::release(TeleopInstant now) {
  wheels_.release();
  arm_.release();
  if (robot().empty()) return {};
  stop_until_ = now.steady + driving_timing::kStopDuration;
  return send_stop(now);
}

Status TeleopClient::halt(TeleopInstant now) {
  const Status stopped = release(now);
  wheels_.require_release();
  arm_.require_release();
  return stopped;
}

Status TeleopClient::release_control(bool lost, const std::string& why, TeleopInstant now) {
  if (robot().empty()) return {};
  const Status halted = halt(now);
  const Status reported = lost ? console_.lose(why, now.stamp) : console_.end(now.stamp);
  robot_ = {};
  moved_joints_.clear();
  return halted ? reported : halted;
}

Status TeleopClient::watch(TeleopInstant now) {
  if (robot().empty()) return {};
  if (now.steady - last_message_ >= driving_timing::kClientLost) {
    const std::string why = "no message from the page for 2 s";
    if (Status gone = release_control(true, why, now); !gone) return gone;
    return Error{why + ": stopped; select the robot again"};
  }
  if (wheels_.fell_silent(now.steady) || arm_.fell_silent(now.steady)) {
    if (Status halted = halt(now); !halted) return halted;
    return Error{"no message from the page for 0.3 s: stopped; release and press again"};
  }
  if (now.steady < stop_until_)
    return now.steady - stop_sent_ < driving_timing::kCommandPeriod ? Status{} : send_stop(now);
  if (!wheels_.held() && !arm_.held()) moved_joints_.clear();
  return console_.beat(now.stamp);
}

bool TeleopClient::is_too_fast(WallTime now) {
  if (now - counted_from_ >= seconds(1.0)) {
    counted_from_ = now;
    counted_ = 0;
  }
  return ++counted_ > kMaxPerSecond;
}

}  // namespace parhelion::station
