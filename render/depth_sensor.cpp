#include "render/depth_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/pixel_noise.hpp"

namespace parhelion::render {
namespace {

constexpr double kMaxMillimetres = 65534;  // 65535 means "no measurement" in some data sets
constexpr double kDrawsInSigma = 30;  // quantiles of the normal distribution are multiples of 1 / 30 sigma

/// 1 sigma draws, to a 30th: within 8.5 sigma.
const PixelNoise& unit_noise() {
  static const PixelNoise noise(kDrawsInSigma);
  return noise;
}

/// Pixels from right to left: their projections in the second view also go from right to left, except where
/// something nearer is in front.
void find_hidden(std::span<const float> disparities, std::vector<bool>& hidden) {
  double seen = std::numeric_limits<double>::infinity();
  for (std::size_t x = disparities.size(); x-- > 0;) {
    const double there = static_cast<double>(x) - static_cast<double>(disparities[x]);
    hidden[x] = there > seen;
    seen = std::min(seen, there);
  }
}

}  // namespace

double farthest_depth(const DepthCameraDescription& camera) {
  return camera.range_max > 0 ? std::min(camera.range_max, kMaxMillimetres / 1000) : kDepthSight;
}

void DepthSensor::measure(const DepthCameraDescription& camera, std::span<const float> depths,
                          std::uint64_t seed, std::uint64_t image, DepthPixels& pixels) {
  const auto width = static_cast<std::size_t>(pixels.width);
  const double farthest = farthest_depth(camera);
  const double disparity_at_1_m = camera.intrinsics.fx * camera.baseline;  // px m
  const bool noisy = camera.noise > 0 || (disparity_at_1_m > 0 && camera.disparity_noise > 0);
  pixels.millimetres.assign(depths.size(), 0);
  disparities_.assign(width, 0);
  hidden_.assign(width, false);
  for (std::size_t row = 0; row < depths.size(); row += width) {
    if (disparity_at_1_m > 0) {
      for (std::size_t x = 0; x < width; ++x)
        disparities_[x] = static_cast<float>(disparity_at_1_m / static_cast<double>(depths[row + x]));
      find_hidden(disparities_, hidden_);
    }
    for (std::size_t x = 0; x < width; ++x) {
      double depth = static_cast<double>(depths[row + x]);
      if (!std::isfinite(depth) || hidden_[x]) continue;
      // Complement, for other draws than those of the colour picture with the same number.
      const double sigmas = noisy ? unit_noise().at(seed, ~image, row + x) / kDrawsInSigma : 0;
      if (disparity_at_1_m > 0) {
        double disparity = disparity_at_1_m / depth + sigmas * camera.disparity_noise;
        if (camera.disparity_step > 0)
          disparity = std::round(disparity / camera.disparity_step) * camera.disparity_step;
        if (!(disparity > 0)) continue;  // treated as infinitely far
        depth = disparity_at_1_m / disparity;
      }
      depth += sigmas * camera.noise;
      if (depth < camera.range_min || depth > farthest) continue;
      pixels.millimetres[row + x] = static_cast<std::uint16_t>(std::lround(depth * 1000));
    }
  }
}

}  // namespace parhelion::render
