#include "fusion/semantic/texture/auto_exposure.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::semantic {
namespace {

constexpr std::size_t kPixelStep = 7;
constexpr double kPriorVariance = 0.005;  ///< of the logarithm: few alike views say nothing about a slope

/// log of the mean luminance of the pixels that show the surface, at equal exposure.
double luminance_of(const ColourView& view, const ViewGeometry& geometry, const Eigen::Vector3f& gain) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  for (std::size_t i = 0; i < geometry.depth.size(); i += kPixelStep) {
    if (geometry.depth[i] <= 0) continue;
    sum += Eigen::Vector3d(view.rgb[3 * i], view.rgb[3 * i + 1], view.rgb[3 * i + 2]);
    count += 1;
  }
  if (count == 0) return 0;
  const Eigen::Vector3d mean = (sum / count).cwiseProduct(gain.cast<double>());
  return std::log(std::max(1.0, mean.dot(Eigen::Vector3d(0.299, 0.587, 0.114))));
}

}  // namespace

AutoExposure fit_auto_exposure(std::span<const ColourView> views, std::span<const ViewGeometry> geometry,
                               std::span<const Eigen::Vector3f> gains) {
  std::vector<double> luminance;
  double mean = 0;
  Eigen::Vector3d mean_gain = Eigen::Vector3d::Zero();
  for (std::size_t v = 0; v < views.size(); ++v) {
    luminance.push_back(luminance_of(views[v], geometry[v], gains[v]));
    mean += luminance.back() / static_cast<double>(views.size());
    mean_gain += gains[v].cast<double>().array().log().matrix() / static_cast<double>(views.size());
  }
  double variance = kPriorVariance, covariance = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const double off = luminance[v] - mean;
    variance += off * off;
    covariance += off * (gains[v].cast<double>().array().log().matrix() - mean_gain).mean();
  }
  return {mean_gain.cast<float>(), static_cast<float>(std::clamp(covariance / variance, 0.0, 1.0)),
          static_cast<float>(mean)};
}

}  // namespace parhelion::semantic
