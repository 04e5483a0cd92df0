#include "server/simulation/world/neighbours.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace parhelion::simulation {
namespace {

constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();

}  // namespace

std::uint32_t Neighbours::bucket(std::int64_t column, std::int64_t row) const {
  const std::uint64_t mixed = static_cast<std::uint64_t>(column) * 0x9E3779B97F4A7C15ULL +
                              static_cast<std::uint64_t>(row) * 0xC2B2AE3D27D4EB4FULL;
  return static_cast<std::uint32_t>(mixed >> 40) & mask_;
}

void Neighbours::start(std::size_t count) {
  std::size_t buckets = 64;
  while (buckets < 2 * count) buckets *= 2;
  mask_ = static_cast<std::uint32_t>(buckets - 1);
  first_.assign(buckets + 1, 0);
  bucket_of_.resize(count);
  members_.resize(count);
  large_.clear();
}

void Neighbours::add(std::uint32_t index, const Eigen::Vector2d& center, double radius) {
  const bool somewhere = radius <= kLarge && center.cwiseAbs().maxCoeff() < 1e9;
  if (!somewhere) {
    bucket_of_[index] = kNowhere;
    large_.push_back(index);
    return;
  }
  bucket_of_[index] = bucket(std::llround(center.x() / kCell), std::llround(center.y() / kCell));
  ++first_[bucket_of_[index] + 1];
}

void Neighbours::finish() {
  for (std::size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
  // Backwards, each bucket's end moves to its beginning.
  for (std::size_t b = first_.size() - 1; b > 0; --b) first_[b] = first_[b - 1];
  for (std::uint32_t i = 0; i < bucket_of_.size(); ++i) {
    if (bucket_of_[i] != kNowhere) members_[first_[bucket_of_[i] + 1]++] = i;
  }
}

void Neighbours::near(const Eigen::Vector2d& p, double range, std::vector<std::uint32_t>& found) const {
  found.assign(large_.begin(), large_.end());
  const double reach = range + kLarge;
  const double cells = 2 * reach / kCell + 2;
  if (!(p.cwiseAbs().maxCoeff() < 1e9) || !(cells * cells < kMaxCells)) {
    for (std::uint32_t i = 0; i < bucket_of_.size(); ++i) {
      if (bucket_of_[i] != kNowhere) found.push_back(i);
    }
  } else {
    const auto cell = [](double x) { return std::llround(x / kCell); };
    for (std::int64_t row = cell(p.y() - reach); row <= cell(p.y() + reach); ++row) {
      for (std::int64_t column = cell(p.x() - reach); column <= cell(p.x() + reach); ++column) {
        const std::uint32_t b = bucket(column, row);
        found.insert(found.end(), members_.begin() + first_[b], members_.begin() + first_[b + 1]);
      }
    }
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
}

}  // namespace parhelion::simulation
