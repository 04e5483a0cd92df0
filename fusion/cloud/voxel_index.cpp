#include "fusion/cloud/voxel_index.hpp"

namespace parhelion::cloud {
namespace {

constexpr std::uint64_t kNoKey = ~std::uint64_t{0};
constexpr int kFirstLog2 = 8;

}  // namespace

VoxelIndex::VoxelIndex()
    : keys_(std::size_t{1} << kFirstLog2, kNoKey),
      block_of_key_(keys_.size()),
      shift_(64 - kFirstLog2),
      last_key_(kNoKey) {}

std::uint64_t VoxelIndex::key(const Eigen::Vector3i& block) {
  const auto part = [](int i) { return static_cast<std::uint64_t>(i) & ((1u << kBits) - 1); };
  return part(block.x()) | part(block.y()) << kBits | part(block.z()) << (2 * kBits);
}

std::size_t VoxelIndex::place(std::uint64_t key) const {
  const std::size_t mask = keys_.size() - 1;
  std::size_t at = (key * 0x9E3779B97F4A7C15ull) >> shift_;
  while (keys_[at] != key && keys_[at] != kNoKey) at = (at + 1) & mask;
  return at;
}

const VoxelIndex::Block* VoxelIndex::find(const Eigen::Vector3i& block) const {
  const std::size_t at = place(key(block));
  return keys_[at] == kNoKey ? nullptr : &blocks_[block_of_key_[at]];
}

std::uint32_t& VoxelIndex::operator[](const Eigen::Vector3i& index) {
  const std::uint64_t k = key({index.x() >> 2, index.y() >> 2, index.z() >> 2});
  if (k != last_key_) {
    std::size_t at = place(k);
    if (keys_[at] == kNoKey) {
      if (2 * (blocks_.size() + 1) > keys_.size()) {
        grow();
        at = place(k);
      }
      keys_[at] = k;
      block_of_key_[at] = static_cast<std::uint32_t>(blocks_.size());
      blocks_.emplace_back().fill(kNone);
    }
    last_key_ = k;
    last_block_ = block_of_key_[at];
  }
  return blocks_[last_block_][within(index)];
}

void VoxelIndex::grow() {
  const std::vector<std::uint64_t> keys = std::move(keys_);
  const std::vector<std::uint32_t> blocks = std::move(block_of_key_);
  --shift_;
  keys_.assign(2 * keys.size(), kNoKey);
  block_of_key_.resize(keys_.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (keys[i] == kNoKey) continue;
    const std::size_t at = place(keys[i]);
    keys_[at] = keys[i];
    block_of_key_[at] = blocks[i];
  }
}

}  // namespace parhelion::cloud
