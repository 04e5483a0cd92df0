#include "tools/calibration/beam_plane.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/calibration/level_floor.hpp"

namespace parhelion::tools {
namespace {

constexpr double kStep = 0.05;  // m, along a beam, of one up to 5 m long
constexpr double kMaxColumns = 100;
constexpr double kBeforeEnd = 0.15;  // m: a surface so near to its end is what a beam ends at
constexpr float kJump = 0.2F;        // m, along the optical axis, from one column to the next
constexpr double kZStep = 0.02, kLowest = -0.3, kMiddle = 0.3;  // m
constexpr std::size_t kZ = 110;
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

/// m along the optical axis: the error of a camera that triangulates grows with the square of the range.
float tolerance(double z) { return static_cast<float>(0.04 + 0.005 * z * z); }

}  // namespace

float before_surface(const Eigen::Vector3d& p_base, const render::DepthPixels& image,
                     const render::Lens& lens, const Eigen::Isometry3d& T_optical_base) {
  const Eigen::Vector3d p = T_optical_base * p_base;
  if (!(p.z() > 0)) return kNone;
  const auto pixel = lens.project(p);
  if (!pixel || !(pixel->x() > -0.5 && pixel->y() > -0.5 && pixel->x() < image.width - 0.5 &&
                  pixel->y() < image.height - 0.5))
    return kNone;
  const double seen =
      depth_at(image, static_cast<int>(std::lround(pixel->x())), static_cast<int>(std::lround(pixel->y())));
  return seen > 0 ? static_cast<float>(seen - p.z()) : kNone;
}

BeamPlane::BeamPlane(const LevelBeam& beam, const render::DepthPixels& image, const render::Lens& lens,
                     const Eigen::Isometry3d& T_optical_base)
    : slope_(beam.slope) {
  const double step = std::max(kStep, beam.range / kMaxColumns);
  for (double s = 2 * step; s < beam.range - step / 2; s += step) s_.push_back(s);
  s_.push_back(beam.range);
  before_.reserve(s_.size() * kZ);
  for (const double s : s_) {
    const Eigen::Vector2d at = beam.origin + s * beam.direction;
    depth_of_end_ = (T_optical_base * Eigen::Vector3d(at.x(), at.y(), kMiddle)).z();
    tolerance_.push_back(tolerance(depth_of_end_));
    for (std::size_t k = 0; k < kZ; ++k)
      before_.push_back(tools::before_surface({at.x(), at.y(), kLowest + kZStep * static_cast<double>(k)},
                                              image, lens, T_optical_base));
  }
}

float BeamPlane::before_surface(std::size_t column, double z) const {
  const double k = (z - kLowest) / kZStep + 0.5;
  return k < 0 || k >= static_cast<double>(kZ) ? kNone : before_[column * kZ + static_cast<std::size_t>(k)];
}

// A beam that was before a surface and comes behind it without a jump has passed through it. With a jump it
// came behind another thing.
std::uint8_t BeamPlane::outcome(double height, double slope, const std::vector<std::uint8_t>& places) const {
  const std::size_t last = s_.size() - 1;
  bool in_front = false;
  float previous = 0, now = 0;
  std::size_t crossed = 0;
  for (std::size_t j = 0; j <= last; ++j) {
    now = before_surface(j, height + (slope_ + slope) * s_[j]);
    if (now > 0) {
      in_front = true;
    } else if (in_front && previous - now < kJump) {
      if (previous > 0) crossed = j;
      if (now < -tolerance_[j]) {
        if (s_[crossed] < s_[last] - kBeforeEnd) return static_cast<std::uint8_t>(1 + places[crossed]);
        in_front = false;
      }
    } else {
      in_front = false;
    }
    previous = now;
  }
  if (now > tolerance_[last]) return static_cast<std::uint8_t>(1 + places[last]);
  return now >= -tolerance_[last] ? BeamOutcomes::kAgrees : BeamOutcomes::kUnknown;
}

}  // namespace parhelion::tools
