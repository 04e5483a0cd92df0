// FNV-1a (Fowler, Noll, Vo), 64 bits: a fast hash that is the same on every machine. Not for security.
#pragma once

#include <cstdint>
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

}  // namespace parhelion
