// Packed values, little-endian, one after the other: what is too large for text. Private to this module.
#pragma once

#include <Eigen/Core>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace parhelion {

static_assert(std::endian::native == std::endian::little);

class Packer {
 public:
  template <class T>
  void number(const T& value) {
    const auto* first = reinterpret_cast<const std::uint8_t*>(&value);
    bytes_.insert(bytes_.end(), first, first + sizeof value);
  }
  void count(std::size_t size) { number(static_cast<std::uint32_t>(size)); }
  void vector(const Eigen::Vector3f& value) {
    for (const float each : value) number(each);
  }
  /// With its length before it.
  void text(const std::string& text) {
    count(text.size());
    bytes_.insert(bytes_.end(), text.begin(), text.end());
  }
  /// With their number before them.
  void bytes(const std::vector<std::uint8_t>& more) {
    count(more.size());
    bytes_.insert(bytes_.end(), more.begin(), more.end());
  }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// Takes values from untrusted bytes. Once there are too few it stays failed, and gives zeros.
class Unpacker {
 public:
  explicit Unpacker(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  bool failed() const { return failed_; }
  bool finished() const { return !failed_ && bytes_.empty(); }

  template <class T>
  T number() {
    T value{};
    if (!has(1, sizeof value)) return value;
    std::memcpy(&value, bytes_.data(), sizeof value);
    bytes_ = bytes_.subspan(sizeof value);
    return value;
  }
  Eigen::Vector3f vector() {
    const auto x = number<float>(), y = number<float>(), z = number<float>();
    return {x, y, z};
  }
  /// A count of values of this size that do remain; 0 else.
  std::size_t count(std::size_t size) {
    const auto count = number<std::uint32_t>();
    return has(count, size) ? count : 0;
  }
  std::string text() {
    const std::span<const std::uint8_t> taken = bytes();
    return {taken.begin(), taken.end()};
  }
  std::span<const std::uint8_t> bytes() {
    const std::size_t size = count(1);
    const auto taken = bytes_.first(size);
    bytes_ = bytes_.subspan(size);
    return taken;
  }
  /// Whether `count` values of `size` bytes remain.
  bool has(std::uint64_t count, std::uint64_t size) {
    failed_ = failed_ || count > bytes_.size() / size;
    return !failed_;
  }

 private:
  std::span<const std::uint8_t> bytes_;
  bool failed_ = false;
};

}  // namespace parhelion
