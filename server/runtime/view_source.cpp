#include "server/runtime/view_source.hpp"

#include <cstdio>
#include <utility>

namespace parhelion::runtime {
namespace {

constexpr double kViewDistance = 0.25;  // m and rad: a closer view shows little new
constexpr double kViewAngle = 0.25;

}  // namespace

ViewSource::ViewSource(UpdateSite update, const tick::Configuration& configuration, int nice)
    : configuration_(configuration), mapper_(std::move(update), configuration, nice) {
  const RobotDescription& robot = configuration.robot;
  if (robot.line_laser) lines_.emplace(*robot.line_laser, robot);
  if (robot.laser && !cloud::lies_level(*robot.laser))
    scan_lines_.emplace(LineLaserDescription{*robot.laser, {}}, robot);
}

void ViewSource::offer(tick::InputKind kind, const tick::RobotState& robot) {
  if (kind == tick::InputKind::depth && robot.camera.depth) offer_depth(*robot.camera.depth, robot.pose);
  if (kind == tick::InputKind::lines && lines_ && robot.scan.line)
    offer_line(*lines_, *robot.scan.line, robot.pose);
  if (kind == tick::InputKind::scan && scan_lines_ && robot.scan.have_real)
    offer_line(*scan_lines_, robot.scan.real, robot.pose);
}

/// Submits lines to the mapper once they have swept an area.
void ViewSource::offer_line(LineSweep& sweep, const Scan& line, const tick::PoseState& robot) {
  sweep.add(line);
  while (auto view = sweep.take(robot)) mapper_.submit(std::move(*view));
}

/// Submits a depth image from a new position, if its pose is known.
void ViewSource::offer_depth(const Image& depth, const tick::PoseState& robot) {
  if (!configuration_.robot.depth) return;
  const DepthCameraDescription& camera = *configuration_.robot.depth;
  const auto pose = tick::robot_pose(robot, depth.stamp);
  const auto turn = pose::head_turn(camera.head, robot.joints, depth.stamp);
  if (!pose || !turn) return;
  const auto T_map_optical = pose->T_map_base * *turn * camera.T_base_optical;
  if (last_view_) {
    const Eigen::Isometry3d moved = (last_view_->inverse() * T_map_optical).isometry();
    const bool turned = Eigen::AngleAxisd(moved.linear()).angle() >= kViewAngle;
    if (moved.translation().norm() < kViewDistance && !turned) return;
  }
  last_view_ = T_map_optical;
  mapper_.submit(PlacedDepth{depth, camera, T_map_optical});
}

std::optional<SiteMapper::Ready> ViewSource::take() {
  auto ready = mapper_.take();
  if (ready) view_to_model_us_.add(ready->latency.microseconds());
  return ready;
}

std::string ViewSource::note() const {
  std::string note = to_text(mapper_.counts());
  const std::uint64_t left_out =
      (lines_ ? lines_->left_out() : 0) + (scan_lines_ ? scan_lines_->left_out() : 0);
  if (left_out > 0) note += "; " + std::to_string(left_out) + " scan lines without a pose or encoder values";
  if (swap_us_.count() == 0) return note;
  char times[160];
  std::snprintf(
      times, sizeof times,
      "; view to model p50 %.0f ms, longest %.0f ms; a new model delayed the loop by at most %.1f ms",
      view_to_model_us_.at(0.5) / 1e3, view_to_model_us_.max() / 1e3, swap_us_.max() / 1e3);
  return note + times;
}

}  // namespace parhelion::runtime
