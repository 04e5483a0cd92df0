#include "fusion/semantic/segmentation/hough.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "fusion/scan/philox.hpp"

namespace parhelion::semantic {
namespace {

constexpr int kAngles = 180;  // of the normal: 1 degree
constexpr int kUpright = 90;  // the normal of a row

class Transform2d {
 public:
  Transform2d(const PixelSet& image, const HoughOptions& options)
      : image_(image), options_(options), left_(image.set().size(), 1), voted_(image.set().size(), 0) {
    radius_ = static_cast<int>(std::ceil(std::hypot(image.width(), image.height()))) + 1;
    first_ = std::max(0, kUpright - options.max_rise);
    end_ = std::min(kAngles, kUpright + options.max_rise + 1);
    votes_.assign(static_cast<std::size_t>(end_ - first_) * static_cast<std::size_t>(2 * radius_ + 1), 0);
    for (int a = first_; a < end_; ++a) {
      const double angle = a * std::numbers::pi / kAngles;
      cosine_[static_cast<std::size_t>(a)] = static_cast<float>(std::cos(angle));
      sine_[static_cast<std::size_t>(a)] = static_cast<float>(std::sin(angle));
    }
  }

  std::vector<PixelSegment> run() {
    std::vector<PixelSegment> found;
    for (const std::uint32_t k : shuffled()) {
      if (!left_[k]) continue;
      const int angle = vote(k);
      if (angle < 0) continue;
      const PixelSegment segment = follow(k, angle);
      if (std::max(std::abs(segment.x1 - segment.x0), std::abs(segment.y1 - segment.y0)) >=
          options_.min_length)
        found.push_back(segment);
    }
    return found;
  }

 private:
  /// All pixels in a seeded random order (Fisher and Yates).
  std::vector<std::uint32_t> shuffled() const {
    std::vector<std::uint32_t> order(left_.size());
    std::iota(order.begin(), order.end(), 0U);
    const scan::PhiloxKey key{static_cast<std::uint32_t>(options_.seed),
                              static_cast<std::uint32_t>(options_.seed >> 32)};
    for (std::size_t i = order.size(); i > 1; --i) {
      const auto word = scan::philox4x32({static_cast<std::uint32_t>(i), 0, 0, 0}, key)[0];
      std::swap(order[i - 1], order[static_cast<std::size_t>(std::uint64_t{word} * i >> 32)]);
    }
    return order;
  }

  int x_of(std::uint32_t i) const { return static_cast<int>(i) % image_.width(); }
  int y_of(std::uint32_t i) const { return static_cast<int>(i) / image_.width(); }

  std::uint16_t& votes(int angle, int x, int y) {
    const auto a = static_cast<std::size_t>(angle);
    const float rho = static_cast<float>(x) * cosine_[a] + static_cast<float>(y) * sine_[a];
    const int r = static_cast<int>(rho + static_cast<float>(radius_) + 0.5F);
    return votes_[static_cast<std::size_t>(angle - first_) * static_cast<std::size_t>(2 * radius_ + 1) +
                  static_cast<std::size_t>(r)];
  }

  /// Adds the pixel's votes; returns the angle of the line with the most votes, or -1 where none has enough.
  int vote(std::uint32_t k) {
    const int x = x_of(image_.set()[k]), y = y_of(image_.set()[k]);
    int best = -1;
    int max_votes = options_.votes - 1;
    for (int a = first_; a < end_; ++a) {
      const int count = ++votes(a, x, y);
      if (count > max_votes) {
        max_votes = count;
        best = a;
      }
    }
    voted_[k] = 1;
    return best;
  }

  void unvote(int x, int y) {
    for (int a = first_; a < end_; ++a) --votes(a, x, y);
  }

  /// Index in set() of the nearest remaining pixel within one pixel of (x, y), across the line; or -1.
  std::int64_t left_near(int x, int y, bool steep) const {
    for (const int offset : {0, -1, 1}) {
      const int px = x + (steep ? offset : 0), py = y + (steep ? 0 : offset);
      if (!image_.inside(px, py) || !image_.at(px, py)) continue;
      const auto& set = image_.set();
      const auto it = std::lower_bound(set.begin(), set.end(), image_.index(px, py));
      const auto k = it - set.begin();
      if (left_[static_cast<std::size_t>(k)]) return k;
    }
    return -1;
  }

  /// Follows the line from pixel k in both directions over gaps up to the limit; removes the pixels it
  /// passes.
  PixelSegment follow(std::uint32_t k, int angle) {
    const double normal = angle * std::numbers::pi / kAngles;
    double dx = -std::sin(normal), dy = std::cos(normal);
    const bool steep = std::abs(dy) > std::abs(dx);
    const double longest = std::max(std::abs(dx), std::abs(dy));
    dx /= longest;
    dy /= longest;
    const int x = x_of(image_.set()[k]), y = y_of(image_.set()[k]);
    std::array<std::pair<int, int>, 2> ends{{{x, y}, {x, y}}};
    std::vector<std::uint32_t> passed = {k};
    for (int side = 0; side < 2; ++side) {
      const double sign = side == 0 ? -1 : 1;
      int gap = 0;
      for (int step = 1; gap <= options_.max_gap; ++step) {
        const int px = static_cast<int>(std::lround(x + sign * step * dx));
        const int py = static_cast<int>(std::lround(y + sign * step * dy));
        if (!image_.inside(px, py)) break;
        const std::int64_t hit = left_near(px, py, steep);
        if (hit < 0) {
          ++gap;
          continue;
        }
        gap = 0;
        ends[static_cast<std::size_t>(side)] = {px, py};
        passed.push_back(static_cast<std::uint32_t>(hit));
      }
    }
    for (const std::uint32_t p : passed) {
      left_[p] = 0;
      if (voted_[p]) unvote(x_of(image_.set()[p]), y_of(image_.set()[p]));
      voted_[p] = 0;
    }
    return {ends[0].first, ends[0].second, ends[1].first, ends[1].second};
  }

  const PixelSet& image_;
  const HoughOptions& options_;
  int radius_, first_ = 0, end_ = kAngles;  // votes go to angles [first, end)
  std::vector<std::uint8_t> left_, voted_;  // per pixel of set()
  std::vector<std::uint16_t> votes_;
  std::array<float, kAngles> cosine_{}, sine_{};
};

}  // namespace

std::vector<PixelSegment> hough_segments(const PixelSet& image, const HoughOptions& options) {
  if (image.set().empty()) return {};
  return Transform2d(image, options).run();
}

}  // namespace parhelion::semantic
