// FNV-1a (Fowler, Noll, Vo), 64 bits: a fast hash that is the same on every machine. Not for security.
#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

namespace parhelion {

inline constexpr std::uint64_t kFnvBasis = 14695981039346656037ULL;

constexpr std::uint64_t fnv1a(std::uint8_t byte, std::uint64_t hash) {
  return (hash ^ byte) * 1099511628211ULL;
}

constexpr std::uint64_t fnv1a(std::string_view text, std::uint64_t hash = kFnvBasis) {
  for (const char c : text) hash = fnv1a(static_cast<std::uint8_t>(c), hash);
  return hash;
}

/// Not the hash of the same bytes one by one, but eight times as fast.
inline std::uint64_t fnv1a_of_blocks(std::span<const std::uint8_t> bytes, std::uint64_t hash = kFnvBasis) {
  while (bytes.size() >= 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data(), 8);
    hash = (hash ^ word) * 1099511628211ULL;
    bytes = bytes.subspan(8);
  }
  for (const std::uint8_t byte : bytes) hash = fnv1a(byte, hash);
  return hash;
}

}  // namespace parhelion
