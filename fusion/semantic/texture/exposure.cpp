#include "fusion/semantic/texture/exposure.hpp"

#include <algorithm>
#include <cmath>

#include "fusion/cloud/parallel.hpp"

namespace parhelion::semantic {
namespace {

constexpr float kDark = 12, kSaturated = 245;  ///< of 255
constexpr int kRounds = 30;
constexpr double kPrior = 20;  ///< samples' worth of belief that a gain is 1

struct LogSample {
  std::size_t begin, end;
};
struct LogColour {
  std::uint32_t view;
  float weight;
  Eigen::Vector3f value;
};

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
    for (const Observation& seen : sample.seen) {
      const Eigen::Vector3f colour = colour_at(views[seen.view], seen.pixel);
      if (colour.minCoeff() < kDark || colour.maxCoeff() > kSaturated) continue;
      colours.push_back({seen.view, seen.weight, colour.array().log().matrix()});
    }
    groups.push_back({begin, colours.size()});
  }
  std::vector<Eigen::Vector3d> gain(views.size(), Eigen::Vector3d::Zero());
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Eigen::Vector3d> sum(views.size(), Eigen::Vector3d::Zero());
    std::vector<double> weight(views.size(), kPrior);
    for (const LogSample& group : groups) {
      if (group.end - group.begin < 2) continue;
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      double total = 0;
      for (std::size_t i = group.begin; i < group.end; ++i) {
        mean += static_cast<double>(colours[i].weight) *
                (colours[i].value.cast<double>() + gain[colours[i].view]);
        total += static_cast<double>(colours[i].weight);
      }
      mean /= total;
      for (std::size_t i = group.begin; i < group.end; ++i) {
        sum[colours[i].view] += mean - colours[i].value.cast<double>();
        weight[colours[i].view] += 1;
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
