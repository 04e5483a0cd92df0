#include "fusion/people/depth_slice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace parhelion::people {
namespace {

constexpr double kMillimetre = 1e-3;  // m

std::size_t pixel(const DepthView& view, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(x);
}

}  // namespace

bool DepthSlice::set(const DepthView& view) {
  scan_.ranges.clear();
  const auto pixels =
      static_cast<std::size_t>(std::max(view.width, 0)) * static_cast<std::size_t>(std::max(view.height, 0));
  if (pixels == 0 || view.millimetres.size() != pixels || view.directions.size() != pixels || !place(view))
    return false;
  laser_.convention.range_min = static_cast<float>(view.range_max > 0 ? view.range_min : options_.range_min);
  laser_.convention.range_max = static_cast<float>(view.range_max > 0 ? view.range_max : options_.range_max);
  laser_.noise_sigma = std::max(view.noise_sigma, options_.noise_sigma);
  const int step = std::max(1, view.width / options_.columns);
  span_beams(view, step);
  if (scan_.ranges.empty()) return false;
  collect(view, step);
  return true;
}

/// The level frame of the slice.
bool DepthSlice::place(const DepthView& view) {
  if (!view.T_map_depth.finite()) return false;
  const Eigen::Vector3d eye = view.T_map_depth.translation();
  const Eigen::Vector3d axis = view.T_map_depth.rotation().col(2);
  if (std::abs(axis.z()) > options_.steepest) return false;
  const auto T_map_laser =
      Transform<Map, Laser>::planar(eye.x(), eye.y(), std::atan2(axis.y(), axis.x()), options_.height);
  motion_ = {T_map_laser, T_map_laser};
  return true;
}

/// Beams over the azimuths of all pixels: three for four columns looked at, as columns lie farther apart in
/// the middle of the image and no beam may be without any.
void DepthSlice::span_beams(const DepthView& view, int step) {
  const Eigen::Matrix3f R_laser_depth =
      (motion_.T_map_laser_end.rotation().transpose() * view.T_map_depth.rotation()).cast<float>();
  float low = std::numeric_limits<float>::infinity(), high = -low;
  const auto include = [&](int x, int y) {
    const Eigen::Vector3f& direction = view.directions[pixel(view, x, y)];
    if (direction.isZero()) return;
    const Eigen::Vector3f in_laser = R_laser_depth * direction;
    const float azimuth = std::atan2(in_laser.y(), in_laser.x());
    low = std::min(low, azimuth);
    high = std::max(high, azimuth);
  };
  for (int y = 0; y < view.height; y += step) include(0, y), include(view.width - 1, y);
  scan_.ranges.clear();
  if (!(high > low)) return;
  const int columns = std::max(2, view.width / step * 3 / 4);
  scan_.angle_min = low;
  scan_.angle_increment = (high - low) / static_cast<float>(columns - 1);
  scan_.ranges.assign(static_cast<std::size_t>(columns), std::numeric_limits<float>::quiet_NaN());
  offset_.assign(scan_.ranges.size(), std::numeric_limits<float>::infinity());
  beam_time_.assign(scan_.ranges.size(), 0);
}

/// Of the points of each beam the one nearest to the slice's middle.
void DepthSlice::collect(const DepthView& view, int step) {
  const Transform<Laser, DepthOptical> T_laser_depth = motion_.T_map_laser_end.inverse() * view.T_map_depth;
  const Eigen::Matrix3f R = T_laser_depth.rotation().cast<float>();
  const Eigen::Vector3f t = T_laser_depth.translation().cast<float>();
  const auto half = static_cast<float>(options_.half_height);
  const auto beams = static_cast<float>(scan_.ranges.size());
  for (int y = 0; y < view.height; y += std::max(step, 2)) {
    for (int x = 0; x < view.width; x += step) {
      const std::size_t at = pixel(view, x, y);
      const auto depth = static_cast<float>(view.millimetres[at] * kMillimetre);
      const Eigen::Vector3f& direction = view.directions[at];
      const float offset = std::abs(depth * R.row(2).dot(direction) + t.z());
      if (depth == 0 || direction.isZero() || !(offset <= half)) continue;
      const Eigen::Vector3f p = depth * (R * direction) + t;
      const float beam = (std::atan2(p.y(), p.x()) - scan_.angle_min) / scan_.angle_increment;
      if (!(beam > -0.5F && beam < beams - 0.5F)) continue;
      const auto index = static_cast<std::size_t>(std::lround(beam));
      if (offset >= offset_[index]) continue;
      offset_[index] = offset;
      scan_.ranges[index] = p.head<2>().norm();
    }
  }
}

std::array<DepthSlice, 2> depth_slices() {
  constexpr double kLegs = 0.35, kChest = 1.15;  // m
  DepthSliceOptions legs, chest;
  legs.height = kLegs, chest.height = kChest;
  return {DepthSlice(legs), DepthSlice(chest)};
}

PeopleOptions slice_people_options() {
  PeopleOptions options;  // chosen on the rooms 4500000 to 4500011 of tests/fusion/people/depth_room
  options.max_log_odds_not_person = 0.2;
  options.min_log_odds_person_unmoved = 0.9;
  options.max_log_odds_not_person_unmoved = 0.4;
  return options;
}

}  // namespace parhelion::people
