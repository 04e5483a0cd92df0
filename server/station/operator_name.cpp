#include "server/station/operator_name.hpp"

#include <array>
#include <cstdint>
#include <cstdio>
#include <random>

#include "protocols/hash.hpp"

namespace parhelion::station {
namespace {

/// FNV-1a with a secret random start, so that names cannot be found by trying them on a log.
std::uint64_t hashed(const std::string& text) {
  static const std::uint64_t start = [] {
    std::random_device device;
    return (std::uint64_t{device()} << 32) | device();
  }();
  const std::uint64_t hash = fnv1a(text, start);
  return hash ^ (hash >> 32);
}

}  // namespace

std::string operator_name(const Identity& who) {
  std::array<char, 16> number{};
  std::snprintf(number.data(), number.size(), "_%06x", static_cast<unsigned>(hashed(who.name) & 0xffffffU));
  return std::string(role_name(who.role)) + number.data();
}

}  // namespace parhelion::station
