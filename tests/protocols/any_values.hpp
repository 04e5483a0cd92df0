// Values for property tests of configuration files: any valid ones.
#pragma once

#include <rapidcheck.h>

#include <bit>
#include <cmath>
#include <string>
#include <vector>

#include "protocols/frames.hpp"

namespace parhelion::test {

/// Any finite double, by its bits, or a short decimal as in a hand-written file.
inline double finite() {
  if (*rc::gen::arbitrary<bool>()) return *rc::gen::inRange(-100'000, 100'000) / 1000.0;
  const double value = std::bit_cast<double>(*rc::gen::arbitrary<std::uint64_t>());
  return std::isfinite(value) ? value : 0.1;
}
inline double positive() {
  const double value = std::abs(finite());
  return value > 0 ? value : 1;
}
/// In [low, high].
inline double between(double low, double high) {
  return low + (high - low) * (*rc::gen::inRange<std::int64_t>(0, (1LL << 53) + 1) * 0x1p-53);
}
inline float between_floats(double low, double high) { return static_cast<float>(between(low, high)); }
template <class Enum>
Enum any_of(int count) {
  return static_cast<Enum>(*rc::gen::inRange(0, count));
}

inline std::string text() {
  std::string out;
  for (const char c : *rc::gen::string<std::string>()) {
    if (static_cast<unsigned char>(c) < 0x80) out += c;
  }
  const std::vector<std::string> texts{
      out, "null", "~", "true", "3", "- a", "a: b", "\xc3\xa9\xe2\x82\xac", " x ", "#", "\'", "", "a: &b *c"};
  return *rc::gen::elementOf(texts);
}

template <class A, class B>
Transform<A, B> upright() {
  return Transform<A, B>::planar(finite(), finite(), between(-4, 4), finite());
}
template <class A, class B>
Transform<A, B> any_pose() {
  if (*rc::gen::arbitrary<bool>()) return upright<A, B>();
  Eigen::Quaterniond q(between(-1, 1), between(-1, 1), between(-1, 1), between(-1, 1));
  if (q.norm() < 0.01) q = Eigen::Quaterniond(0, 0, 0, 1);
  return {q, {finite(), finite(), finite()}};
}

template <class A, class B>
bool same(const Transform<A, B>& a, const Transform<A, B>& b) {
  return a.isometry().matrix() == b.isometry().matrix();
}

}  // namespace parhelion::test
