#include "fusion/semantic/texture/bake.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "fusion/cloud/parallel.hpp"

namespace parhelion::semantic {
namespace {

constexpr float kOutlier = 22;  ///< of 255: views that differ from the others by more count little

struct Candidate {
  std::uint32_t view;
  float weight;
};

/// The best views of a quad.
std::vector<Candidate> best_views(const QuadSurface& surface, std::size_t quad, const Eigen::Vector3f& normal,
                                  std::span<const ViewGeometry> geometry, std::size_t count) {
  std::vector<Candidate> found;
  const Eigen::Vector3f middle = quad_point(surface, quad, 0.5F, 0.5F);
  for (std::size_t v = 0; v < geometry.size(); ++v) {
    const Sight seen = sight(geometry[v], middle, normal);
    if (seen.weight > 0) found.push_back({static_cast<std::uint32_t>(v), seen.weight});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Candidate& a, const Candidate& b) { return a.weight > b.weight; });
  if (found.size() > count) {
    // The first that is left out has no weight: what is chosen changes without a step from quad to quad.
    const float last = found[count].weight;
    found.resize(count);
    for (Candidate& each : found) each.weight -= 0.9F * last;
  }
  return found;
}

struct Sample {
  Eigen::Vector3f colour;
  float weight;
};

/// Weighted mean, then again with less weight for what differs from it: people who passed, views that are
/// misplaced.
Eigen::Vector3f robust_mean(const std::vector<Sample>& samples) {
  const auto mean_of = [&](auto weight) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float total = 0;
    for (const Sample& sample : samples) {
      const float w = weight(sample);
      sum += w * sample.colour;
      total += w;
    }
    return Eigen::Vector3f(sum / total);
  };
  Eigen::Vector3f mean = mean_of([](const Sample& sample) { return sample.weight; });
  for (int round = 0; round < 2; ++round) {
    const Eigen::Vector3f around = mean;
    mean = mean_of([&](const Sample& sample) {
      const float off = (sample.colour - around).squaredNorm() / (kOutlier * kOutlier);
      return sample.weight / (1 + off);
    });
  }
  return mean;
}

class Baker {
 public:
  Baker(const QuadSurface& surface, std::span<const ColourView> views, std::span<const ViewGeometry> geometry,
        std::span<const Eigen::Vector3f> gains, const BakeOptions& options)
      : surface_(surface), views_(views), geometry_(geometry), gains_(gains), options_(options) {}

  bool quad(std::size_t index, BakedSurface& baked) const {
    const Eigen::Vector3f normal = quad_normal(surface_, index).normalized();
    const auto candidates =
        best_views(surface_, index, normal, geometry_, static_cast<std::size_t>(options_.views));
    if (candidates.empty()) return false;
    const int n = options_.patch;
    std::vector<Sample> samples;
    for (int row = 0; row < n; ++row) {
      for (int column = 0; column < n; ++column) {
        const float s = static_cast<float>(column) / static_cast<float>(n - 1);
        const float t = static_cast<float>(row) / static_cast<float>(n - 1);
        collect(quad_point(surface_, index, s, t), normal, candidates, samples);
        const Eigen::Vector2f texel = baked.texel(index, s, t);
        const auto at =
            3 * (static_cast<std::size_t>(std::lround(texel.y())) * static_cast<std::size_t>(baked.width) +
                 static_cast<std::size_t>(std::lround(texel.x())));
        const Eigen::Vector3f colour = robust_mean(samples);
        for (std::size_t c = 0; c < 3; ++c)
          baked.rgb[at + c] = static_cast<std::uint8_t>(
              std::lround(std::clamp(colour[static_cast<Eigen::Index>(c)], 0.F, 255.F)));
      }
    }
    return true;
  }

 private:
  void collect(const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
               const std::vector<Candidate>& candidates, std::vector<Sample>& samples) const {
    samples.clear();
    for (const Candidate& candidate : candidates) {
      const ViewGeometry& view = geometry_[candidate.view];
      const Eigen::Vector3d p = view.T_optical_map * point.cast<double>();
      if (p.z() < 0.05) continue;
      const Eigen::Vector2d pixel = view.camera.project(p);
      if (!view.camera.contains(pixel)) continue;
      const Sight seen = sight(view, point, normal);
      // A texel that its own view does not see takes the colour there as a last resort.
      const float weight = std::pow(candidate.weight, options_.sharpness) * (seen.weight > 0 ? 1.F : 1e-3F);
      samples.push_back(
          {colour_at(views_[candidate.view], pixel).cwiseProduct(gains_[candidate.view]), weight});
    }
    if (samples.empty()) samples.push_back({Eigen::Vector3f::Constant(128), 1});
  }

  const QuadSurface& surface_;
  std::span<const ColourView> views_;
  std::span<const ViewGeometry> geometry_;
  std::span<const Eigen::Vector3f> gains_;
  const BakeOptions& options_;
};

/// Patches in a row: about as many as rows.
int patches_in_row(std::size_t quads) {
  return std::max(1, static_cast<int>(std::ceil(std::sqrt(static_cast<double>(quads)))));
}

}  // namespace

Eigen::Vector2f BakedSurface::texel(std::size_t quad, float s, float t) const {
  const auto row_length = static_cast<std::size_t>(patches_per_row());
  const auto x = static_cast<float>(quad % row_length), y = static_cast<float>(quad / row_length);
  const auto n = static_cast<float>(patch), last = static_cast<float>(patch - 1);
  return {x * n + s * last, y * n + t * last};
}

BakedSurface bake(const QuadSurface& surface, std::span<const ColourView> views,
                  std::span<const ViewGeometry> geometry, std::span<const Eigen::Vector3f> gains,
                  const BakeOptions& options) {
  BakedSurface baked;
  baked.patch = options.patch;
  const int row_length = patches_in_row(surface.quads.size());
  baked.width = row_length * options.patch;
  const std::size_t rows = (surface.quads.size() + static_cast<std::size_t>(row_length) - 1) /
                           static_cast<std::size_t>(row_length);
  baked.height = static_cast<int>(rows) * options.patch;
  baked.rgb.assign(3 * static_cast<std::size_t>(baked.width) * static_cast<std::size_t>(baked.height), 128);
  std::vector<std::uint8_t> seen(surface.quads.size());
  const Baker baker(surface, views, geometry, gains, options);
  cloud::for_each_chunk(surface.quads.size(), 256, options.threads,
                        [&](std::size_t, std::size_t begin, std::size_t end) {
                          for (std::size_t i = begin; i < end; ++i) seen[i] = baker.quad(i, baked);
                        });
  baked.seen.assign(seen.begin(), seen.end());
  return baked;
}

}  // namespace parhelion::semantic
