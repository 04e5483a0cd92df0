#include "tools/demo/witness.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace parhelion::tools {
namespace {

constexpr std::size_t kCamerasKept = 8;  // images that may be in the render pipeline at once
constexpr double kNearestDrawn = 1;      // m: a virtual return nearer than that hides the rest of the scan
constexpr int kSlightChange = 5;
constexpr int kVisibleChange = 24;  // of 255: well above what encoding an unchanged pixel again does

WitnessedScan place(const tick::Configuration& configuration, const tick::ScanState& scan,
                    const pose::PoseAtInstant& pose) {
  WitnessedScan seen;
  seen.T_map_base = pose.T_map_base;
  seen.T_map_laser = pose.T_map_base * configuration.robot.laser->T_base_laser;
  seen.world = scan.world_end;
  for (std::size_t i = 0; i < scan.out.ranges.size(); ++i) {
    if (configuration.robot.laser->convention.classify(scan.out.ranges[i]) != BeamKind::hit) continue;
    const double angle = scan.out.angle(i);
    const Eigen::Vector3d p_laser(scan.out.ranges[i] * std::cos(angle), scan.out.ranges[i] * std::sin(angle),
                                  0);
    const Eigen::Vector2d p_map = (seen.T_map_laser * p_laser).head<2>();
    const bool is_virtual = scan.beam_body[i] >= 0;
    (is_virtual ? seen.virtual_returns : seen.real_returns).push_back(p_map);
    seen.replaced += is_virtual ? 1 : 0;
    if (is_virtual) seen.nearest = std::min<double>(seen.nearest, scan.out.ranges[i]);
  }
  return seen;
}

}  // namespace

void Witness::see(const tick::Configuration& configuration, const Message& input,
                  const tick::RobotState& robot) {
  const tick::InputKind kind = configuration.channels.kind(input.channel);
  if (kind == tick::InputKind::camera) return remember(input);
  if (kind != tick::InputKind::scan || !robot.injection.live) return;
  const auto pose = robot.pose.track.at(robot.scan.real.stamp);
  if (!pose) return;
  driven_.push_back(pose->T_map_base.translation().head<2>());
  std::string last;
  for_each_body(robot.scan.world_end, [&](const BodyDefinition& definition, const BodyState& body) {
    if (definition.owner != BodyOwner::agent || definition.entity == last) return;
    last = definition.entity;
    agent_paths_[last].push_back(body.T_map_body.translation().head<2>());
  });
  WitnessedScan seen = place(configuration, robot.scan, *pose);
  if (seen.replaced == 0) return;
  const auto rank = [](const WitnessedScan& scan) {
    return std::pair(scan.nearest >= kNearestDrawn, scan.replaced);
  };
  if (!best_scan_ || rank(seen) > rank(*best_scan_)) best_scan_ = std::move(seen);
}

void Witness::remember(const Message& input) {
  Image camera;
  if (!decode(input.channel, input.payload, camera)) return;
  cameras_.push_back(std::move(camera));
  if (cameras_.size() > kCamerasKept) cameras_.pop_front();
}

void Witness::see_answer(const Image& answer) {
  const auto asked = std::find_if(cameras_.begin(), cameras_.end(),
                                  [&](const Image& camera) { return camera.stamp == answer.stamp; });
  if (asked == cameras_.end() || asked->bytes == answer.bytes) return;
  if (!codec_.decode(asked->bytes, before_) || !codec_.decode(answer.bytes, after_)) return;
  if (before_.size() != after_.size()) return;
  const auto width = static_cast<std::size_t>(answer.width);
  const auto is_changed = [this](std::size_t pixel) {
    return std::abs(int{before_[3 * pixel]} - int{after_[3 * pixel]}) > kVisibleChange;
  };
  std::size_t changed = 0;
  for (std::size_t pixel = 0; 3 * pixel < before_.size(); ++pixel) changed += is_changed(pixel) ? 1 : 0;
  // Reject a body that is cut off by the side of the picture.
  for (std::size_t row = 0; 3 * (row + 1) * width <= before_.size(); ++row) {
    if (is_changed(row * width) || is_changed((row + 1) * width - 1)) changed /= 2;
  }
  // Also reject a body whose feet are below the picture. A grey side on a grey floor differs less than a blue
  // one.
  std::size_t at_bottom = 0;
  for (std::size_t i = before_.size() - 3 * width; i < before_.size(); ++i)
    at_bottom += std::abs(int{before_[i]} - int{after_[i]}) > kSlightChange ? 1 : 0;
  if (at_bottom > width / 20) changed /= 16;
  if (changed <= best_pixels_) return;
  best_pixels_ = changed;
  best_image_ = answer;
}

}  // namespace parhelion::tools
