#include "fusion/semantic/texture/depth_holes.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::semantic {
namespace {

constexpr float kSamePlane = 1.25F;  ///< ratio of the depths of two borders that may belong to one surface
constexpr int kSmoothing = 24;       ///< rounds

/// Inverse depths, 0: none.
struct Guess {
  float inverse = 0, weight = 0;
};

class Filler {
 public:
  Filler(const DepthView& view, double farthest)
      : camera_(view.camera), measured_(view.camera.pixels(), 0.F) {
    for (std::size_t i = 0; i < measured_.size(); ++i) {
      const double depth = view.millimetres[i] * 1e-3;
      if (depth > 0 && depth <= farthest) measured_[i] = static_cast<float>(1 / depth);
    }
    guesses_.resize(measured_.size());
    const auto width = static_cast<std::size_t>(camera_.width),
               height = static_cast<std::size_t>(camera_.height);
    for (std::size_t row = 0; row < height; ++row) line(row * width, 1, width);
    for (std::size_t column = 0; column < width; ++column) line(column, width, height);
    for (Guess& guess : guesses_)
      if (guess.weight > 0) guess.inverse /= guess.weight;
    for (int round = 0; round < kSmoothing; ++round) smooth();
  }

  std::vector<std::uint16_t> millimetres() const {
    std::vector<std::uint16_t> result(guesses_.size(), 0);
    for (std::size_t i = 0; i < result.size(); ++i)
      if (guesses_[i].weight > 0)
        result[i] = static_cast<std::uint16_t>(std::min(65534.F, 1000 / guesses_[i].inverse));
    return result;
  }

 private:
  /// All holes of a row or column of `count` pixels.
  void line(std::size_t first, std::size_t step, std::size_t count) {
    std::size_t before = count;  // none yet
    for (std::size_t i = 0; i < count; ++i) {
      if (measured_[first + i * step] <= 0) continue;
      if (before < count && i > before + 1) fill(first, step, before, i);
      before = i;
    }
  }

  void fill(std::size_t first, std::size_t step, std::size_t from, std::size_t to) {
    const float a = measured_[first + from * step], b = measured_[first + to * step];
    const bool plane = std::max(a, b) < kSamePlane * std::min(a, b);
    const auto length = static_cast<float>(to - from);
    for (std::size_t i = from + 1; i < to; ++i) {
      const float s = static_cast<float>(i - from) / length;
      const float inverse = plane ? a + s * (b - a) : std::min(a, b);
      Guess& guess = guesses_[first + i * step];
      const float weight = 1 / (length * length);
      guess.inverse += weight * inverse;
      guess.weight += weight;
    }
  }

  void smooth() {
    const std::vector<Guess> before = guesses_;
    for (int row = 1; row + 1 < camera_.height; ++row) {
      for (int column = 1; column + 1 < camera_.width; ++column) {
        const std::size_t here = camera_.at(column, row);
        if (before[here].weight <= 0) continue;
        float sum = 2 * before[here].inverse, total = 2;
        for (const std::size_t beside : {here - 1, here + 1, here - static_cast<std::size_t>(camera_.width),
                                         here + static_cast<std::size_t>(camera_.width)}) {
          const float inverse = before[beside].weight > 0 ? before[beside].inverse : measured_[beside];
          if (inverse <= 0 ||
              std::max(inverse, before[here].inverse) > kSamePlane * std::min(inverse, before[here].inverse))
            continue;
          sum += inverse;
          total += 1;
        }
        guesses_[here].inverse = sum / total;
      }
    }
  }

  Pinhole camera_;
  std::vector<float> measured_;
  std::vector<Guess> guesses_;
};

}  // namespace

DepthView filled_holes(const DepthView& view, double farthest) {
  return {view.camera, view.T_map_optical, Filler(view, farthest).millimetres()};
}

}  // namespace parhelion::semantic
