// Small LAS files (LAS 1.4 R15, ASPRS).
#pragma once

#include <cstdint>
#include <cstring>
#include <string>

namespace parhelion::test {

/// By point format: bytes of a record, and of those before its colour; 0: no colour.
inline constexpr std::size_t kLasRecord[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
inline constexpr std::size_t kLasColour[] = {0, 0, 20, 28, 0, 28, 0, 30, 30, 0, 30};

template <class Number>
void put(std::string& bytes, std::size_t at, Number value) {
  std::memcpy(bytes.data() + at, &value, sizeof(Number));
}

/// Two points, (1 2 3) and (-4 5.5 6), off by `offset` m in x and y; red where the format has colours.
inline std::string las(int minor, std::size_t format, double offset = 0, std::uint16_t red = 65535) {
  const std::size_t header = minor == 4 ? 375 : minor == 3 ? 235 : 227;
  std::string bytes(header + 2 * kLasRecord[format], '\0');
  std::memcpy(bytes.data(), "LASF", 4);
  put<std::uint8_t>(bytes, 24, 1), put<std::uint8_t>(bytes, 25, static_cast<std::uint8_t>(minor));
  put<std::uint32_t>(bytes, 96, static_cast<std::uint32_t>(header));
  put<std::uint8_t>(bytes, 104, static_cast<std::uint8_t>(format));
  put<std::uint16_t>(bytes, 105, static_cast<std::uint16_t>(kLasRecord[format]));
  if (minor == 4)
    put<std::uint64_t>(bytes, 247, 2);
  else
    put<std::uint32_t>(bytes, 107, 2);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    put<double>(bytes, 131 + 8 * axis, 0.001);
    put<double>(bytes, 155 + 8 * axis, axis < 2 ? offset : 0);
  }
  const std::int32_t points[2][3] = {{1000, 2000, 3000}, {-4000, 5500, 6000}};
  for (std::size_t i = 0; i < 2; ++i) {
    const std::size_t at = header + i * kLasRecord[format];
    for (std::size_t axis = 0; axis < 3; ++axis) put<std::int32_t>(bytes, at + 4 * axis, points[i][axis]);
    if (kLasColour[format] > 0) put<std::uint16_t>(bytes, at + kLasColour[format], red);
  }
  return bytes;
}

}  // namespace parhelion::test
