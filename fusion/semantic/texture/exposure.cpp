#include "fusion/semantic/texture/exposure.hpp"

#include <algorithm>
#include <cmath>

#include "fusion/cloud/parallel.hpp"

namespace parhelion::semantic {
namespace {

constexpr float kDark = 12, kSaturated = 245;  ///< of 255
constexpr float kPoor = 0.05F;                 ///< of the best view's weight: at an edge
constexpr int kRounds = 30;
constexpr double kPrior = 20;  ///< samples' worth of belief that a gain is 1
/// Differences of logarithms that count half: views start with unequal exposure.
constexpr double kFirstOutlier = 0.6, kOutlier = 0.12;
constexpr double kShrink = 0.85;  ///< of the same, a round

struct LogSample {
  std::size_t begin, end;
};
struct LogColour {
  std::uint32_t view;
  float weight;
  Eigen::Vector3f value;
};

bool is_unmeasured(const ColourView& view, const Eigen::Vector2d& pixel) {
  const std::size_t at = view.camera.at(static_cast<int>(pixel.x() + 0.5), static_cast<int>(pixel.y() + 0.5));
  return !view.witnessed.empty() && view.witnessed[at] == Witnessed::unmeasured;
}

/// Weight of a difference, by Cauchy's kernel.
double belief(const Eigen::Vector3d& off, double outlier) {
  return 1 / (1 + off.squaredNorm() / (outlier * outlier));
}

/// What most views show of a sample: from the median of each channel, a step towards the mean of those near
/// it.
Eigen::Vector3d consensus(std::span<const LogColour> colours, std::span<const Eigen::Vector3d> gain,
                          double outlier) {
  Eigen::Vector3d median;
  std::vector<double> values(colours.size());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  for (Eigen::Index c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < colours.size(); ++i)
      values[i] = static_cast<double>(colours[i].value[c]) + gain[colours[i].view][c];
    std::nth_element(values.begin(), middle, values.end());
    median[c] = *middle;
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double total = 0;
  for (const LogColour& colour : colours) {
    const Eigen::Vector3d value = colour.value.cast<double>() + gain[colour.view];
    const double weight = static_cast<double>(colour.weight) * belief(value - median, outlier);
    sum += weight * value;
    total += weight;
  }
  return sum / total;
}

}  // namespace

std::vector<SurfaceSample> sample_surface(const QuadSurface& surface, std::span<const ViewGeometry> views,
                                          std::size_t count, int threads) {
  const std::size_t step = std::max<std::size_t>(1, surface.quads.size() / std::max<std::size_t>(1, count));
  std::vector<SurfaceSample> samples((surface.quads.size() + step - 1) / step);
  cloud::for_each_chunk(samples.size(), 256, threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      SurfaceSample& sample = samples[i];
      sample.point = quad_point(surface, i * step, 0.5F, 0.5F);
      sample.normal = quad_normal(surface, i * step).normalized();
      for (std::size_t v = 0; v < views.size(); ++v) {
        const Sight seen = sight(views[v], sample.point, sample.normal);
        if (seen.weight > 0) sample.seen.push_back({static_cast<std::uint32_t>(v), seen.weight, seen.pixel});
      }
    }
  });
  std::erase_if(samples, [](const SurfaceSample& sample) { return sample.seen.size() < 2; });
  return samples;
}

std::vector<Eigen::Vector3f> exposure_gains(std::span<const ColourView> views,
                                            std::span<const SurfaceSample> samples) {
  std::vector<LogColour> colours;
  std::vector<LogSample> groups;
  for (const SurfaceSample& sample : samples) {
    const std::size_t begin = colours.size();
    float best = 0;
    for (const Observation& seen : sample.seen) best = std::max(best, seen.weight);
    for (const Observation& seen : sample.seen) {
      if (seen.weight < kPoor * best || is_unmeasured(views[seen.view], seen.pixel)) continue;
      const Eigen::Vector3f colour = colour_at(views[seen.view], seen.pixel);
      if (colour.minCoeff() < kDark || colour.maxCoeff() > kSaturated) continue;
      colours.push_back({seen.view, seen.weight, colour.array().log().matrix()});
    }
    groups.push_back({begin, colours.size()});
  }
  std::vector<Eigen::Vector3d> gain(views.size(), Eigen::Vector3d::Zero());
  double outlier = kFirstOutlier;
  for (int round = 0; round < kRounds; ++round, outlier = std::max(kOutlier, kShrink * outlier)) {
    std::vector<Eigen::Vector3d> sum(views.size(), Eigen::Vector3d::Zero());
    std::vector<double> weight(views.size(), kPrior);
    for (const LogSample& group : groups) {
      if (group.end - group.begin < 2) continue;
      const Eigen::Vector3d mean = consensus({&colours[group.begin], group.end - group.begin}, gain, outlier);
      for (std::size_t i = group.begin; i < group.end; ++i) {
        const Eigen::Vector3d off = mean - colours[i].value.cast<double>();
        const double trust = belief(off - gain[colours[i].view], outlier);
        sum[colours[i].view] += trust * off;
        weight[colours[i].view] += trust;
      }
    }
    for (std::size_t v = 0; v < views.size(); ++v) gain[v] = sum[v] / weight[v];
  }
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& g : gain)
    mean += g / static_cast<double>(std::max<std::size_t>(1, gain.size()));
  std::vector<Eigen::Vector3f> factors;
  for (const Eigen::Vector3d& g : gain) factors.push_back((g - mean).array().exp().matrix().cast<float>());
  return factors;
}

}  // namespace parhelion::semantic
