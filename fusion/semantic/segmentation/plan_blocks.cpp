#include "fusion/semantic/segmentation/plan_blocks.hpp"

#include <cassert>
#include <limits>
#include <unordered_map>

#include "fusion/cloud/floor_index.hpp"

namespace parhelion::semantic {
namespace {

constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();

/// Order of keys is the order of (y, x).
std::uint64_t key_of(int x, int y) {
  constexpr auto bias = std::int64_t{1} << 31;
  return static_cast<std::uint64_t>(y + bias) << 32 | static_cast<std::uint64_t>(x + bias);
}

/// Gives each point the number of its block, in the order of first appearance.
std::vector<std::uint32_t> number_blocks(std::span<const Eigen::Vector3f> points, double side,
                                         std::vector<PlanBlocks::Block>& blocks) {
  std::vector<std::uint32_t> number(points.size(), kNowhere);
  std::unordered_map<std::uint64_t, std::uint32_t> known;
  const double per_metre = 1 / side;
  std::uint64_t last_key = 0;
  std::uint32_t last = kNowhere;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double x = points[i].x(), y = points[i].y();
    if (!(std::abs(x) <= PlanBlocks::kReach && std::abs(y) <= PlanBlocks::kReach)) continue;
    const int bx = cloud::floor_index(x * per_metre), by = cloud::floor_index(y * per_metre);
    const std::uint64_t key = key_of(bx, by);
    if (last == kNowhere || key != last_key) {
      const auto [it, is_new] = known.try_emplace(key, static_cast<std::uint32_t>(blocks.size()));
      if (is_new) blocks.push_back({bx, by, 0, 0});
      last = it->second;
      last_key = key;
    }
    number[i] = last;
    ++blocks[last].end;
  }
  return number;
}

}  // namespace

PlanBlocks::PlanBlocks(std::span<const Eigen::Vector3f> points, double side) : side_(side) {
  assert(side > 0);
  std::vector<Block> found;
  const std::vector<std::uint32_t> number = number_blocks(points, side, found);
  std::vector<std::uint32_t> by_place(found.size());
  for (std::uint32_t i = 0; i < by_place.size(); ++i) by_place[i] = i;
  std::sort(by_place.begin(), by_place.end(), [&](std::uint32_t a, std::uint32_t b) {
    return key_of(found[a].x, found[a].y) < key_of(found[b].x, found[b].y);
  });
  std::vector<std::uint32_t> next(found.size());
  std::uint32_t at = 0;
  for (const std::uint32_t i : by_place) {
    blocks_.push_back({found[i].x, found[i].y, at, at + found[i].end});
    next[i] = at;
    at += found[i].end;
  }
  sorted_.resize(at);
  order_.resize(at);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (number[i] == kNowhere) continue;
    const std::uint32_t to = next[number[i]]++;
    sorted_[to] = points[i];
    order_[to] = static_cast<std::uint32_t>(i);
  }
}

}  // namespace parhelion::semantic
