#include "server/runtime/line_sweep.hpp"

#include <algorithm>
#include <utility>

namespace parhelion::runtime {

LineSweep::LineSweep(const LineLaserDescription& laser, const RobotDescription& robot,
                     const LineSweepOptions& options)
    : laser_(laser), options_(options) {
  growing_.laser = laser.laser;
  growing_.body = {robot.footprint, robot.height};
}

void LineSweep::add(const Scan& line) {
  if (!waiting_.empty() && line.stamp <= waiting_.back().stamp) {
    left_out_ += waiting_.size();
    waiting_.clear();
  }
  if (waiting_.size() == kMaxWaiting) {
    ++left_out_;
    waiting_.pop_front();
  }
  waiting_.push_back(line);
}

std::optional<LineView> LineSweep::take(const tick::PoseState& robot) {
  while (!waiting_.empty() && waiting_.front().stamp + options_.settle <= waiting_.back().stamp) {
    auto line = placed(robot, std::move(waiting_.front()));
    waiting_.pop_front();
    if (!line) {
      ++left_out_;
    } else if (auto view = keep(std::move(*line))) {
      return view;
    }
  }
  return std::nullopt;
}

/// Encoder values are interpolated, never extrapolated: at one rad/s, 20 ms are a degree.
std::optional<cloud::PlacedLine> LineSweep::placed(const tick::PoseState& robot, Scan line) const {
  const cloud::LineSpan span = cloud::line_span(laser_.laser, line);
  cloud::PlacedLine result;
  const auto place = [&](SensorTime t, Transform<Map, Laser>& T_map_laser) {
    const auto pose = tick::robot_pose(robot, t);
    const bool reached = std::all_of(laser_.head.begin(), laser_.head.end(), [&](const HeadJoint& joint) {
      return robot.joints.reaches(joint.joint, t);
    });
    const auto turn = pose::head_turn(laser_.head, robot.joints, t);
    if (!pose || !reached || !turn) return false;
    result.T_base_laser = *turn * laser_.laser.T_base_laser;
    T_map_laser = pose->T_map_base * result.T_base_laser;
    return true;
  };
  if (!place(line.stamp + span.end, result.T_map_laser_end) ||
      !place(line.stamp + span.start, result.T_map_laser_start))
    return std::nullopt;
  result.line = std::move(line);
  return result;
}

std::optional<LineView> LineSweep::keep(cloud::PlacedLine line) {
  std::optional<LineView> done;
  if (!growing_.lines.empty()) {
    const cloud::PlacedLine& last = growing_.lines.back();
    const Eigen::Isometry3d moved = (last.T_map_laser_start.inverse() * line.T_map_laser_start).isometry();
    const double distance = moved.translation().norm();
    const double angle = Eigen::AngleAxisd(moved.linear()).angle();
    const bool apart = distance > options_.leap || line.line.stamp - last.line.stamp > options_.silence;
    if (!apart && distance < options_.min_travel && angle < options_.min_turn) return std::nullopt;
    if (apart || driven_ >= options_.drive || turned_ >= options_.turn) {
      LineView whole = start_anew();
      if (whole.lines.size() >= options_.min_lines) done = std::move(whole);
    } else {
      driven_ += distance;
      turned_ += angle;
    }
  }
  growing_.lines.push_back(std::move(line));
  return done;
}

LineView LineSweep::start_anew() {
  LineView whole{std::move(growing_.lines), growing_.laser, growing_.body};
  growing_.lines.clear();
  driven_ = turned_ = 0;
  return whole;
}

}  // namespace parhelion::runtime
