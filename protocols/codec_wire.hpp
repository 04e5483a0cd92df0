// Reading and writing of LCM's encoding for the codec_*.cpp files: big-endian, every count checked against
// the bytes that are left before anything is allocated (the decoders that lcm-gen writes allocate first).
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "protocols/codec.hpp"

namespace parhelion::wire {

template <class T>
using UnsignedOf =
    std::conditional_t<sizeof(T) == 1, std::uint8_t,
                       std::conditional_t<sizeof(T) == 2, std::uint16_t,
                                          std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>>>;

/// The other byte order, on a machine that is not big-endian itself.
template <class Unsigned>
Unsigned swapped(Unsigned bits) {
  if constexpr (sizeof(Unsigned) == 1 || std::endian::native == std::endian::big) {
    return bits;
  } else if constexpr (sizeof(Unsigned) == 2) {
    return __builtin_bswap16(bits);
  } else if constexpr (sizeof(Unsigned) == 4) {
    return __builtin_bswap32(bits);
  } else {
    return __builtin_bswap64(bits);
  }
}

template <class T>
T big_endian(const std::uint8_t* at) {
  UnsignedOf<T> bits;
  std::memcpy(&bits, at, sizeof bits);
  return std::bit_cast<T>(swapped(bits));
}

template <class T>
void big_endian(T value, std::uint8_t* at) {
  const auto bits = swapped(std::bit_cast<UnsignedOf<T>>(value));
  std::memcpy(at, &bits, sizeof bits);
}

/// Positions are within the Earth, velocities and other figures within what any robot does: a float that is
/// merely finite would overflow in the first square.
inline constexpr double max_position = 1e8;
inline constexpr double max_rate = 1e6;

/// Reads one message. After the first failure every read gives zero, so a decoder is a plain list of fields;
/// `status()` then says what was wrong.
class Reader {
 public:
  /// Checks the fingerprint.
  Reader(std::string_view channel, const char* type, std::int64_t fingerprint, Bytes bytes);

  template <class T>
  T number(const char* field) {
    return take(field, sizeof(T)) ? big_endian<T>(bytes_.data() + at_ - sizeof(T)) : T{};
  }
  /// Finite and at most `limit` in magnitude.
  template <class T = double>
  T bounded(const char* field, double limit) {
    const T value = number<T>(field);
    if (!(std::abs(value) <= limit)) fail_value(field, value, "a finite number of sensible size");
    return value;
  }
  Eigen::Vector3d vector(const char* field, double limit);
  /// Unit quaternion w, x, y, z, normalized again; within 1 % of length 1.
  Eigen::Quaterniond orientation(const char* field);
  /// An LCM boolean: 0 or 1.
  bool boolean(const char* field);
  /// int8 in 0..last.
  template <class Enumeration>
  Enumeration enumeration(const char* field, Enumeration last) {
    const auto value = number<std::int8_t>(field);
    check_range(field, value, 0, static_cast<std::int64_t>(last));
    return ok() ? static_cast<Enumeration>(value) : Enumeration{};
  }
  /// A number of elements of at least `element_size` bytes each: not negative, and that many bytes are there.
  std::size_t count(const char* field, std::size_t element_size, std::size_t most);
  /// A string: length with its NUL, no NUL within. Reuses the capacity of `text`.
  void text(const char* field, std::string& text);
  void raw(const char* field, std::size_t n, std::vector<std::uint8_t>& out);
  void floats(const char* field, std::size_t n, std::vector<float>& out);
  SensorTime utime();
  /// utime and the nanoseconds within it.
  std::int64_t nanosecond_stamp();

  void check_range(const char* field, std::int64_t value, std::int64_t least, std::int64_t most);
  /// Fails with "<field>: <found>, expected <expected>" unless `good`.
  void check(bool good, const char* field, const char* found, const char* expected);
  void fail_value(const char* field, double value, const char* expected);
  bool ok() const { return problem_.empty(); }
  /// Success where all was well and no byte is left over.
  Status status();

 private:
  bool take(const char* field, std::size_t n);
  void fail(std::string problem);

  std::string_view channel_;
  const char* type_;
  Bytes bytes_;
  std::size_t at_ = 0;
  std::string problem_;
};

/// Writes one message into a vector whose capacity is kept.
class Writer {
 public:
  Writer(std::int64_t fingerprint, std::vector<std::uint8_t>& bytes) : bytes_(bytes) {
    bytes_.clear();
    number(fingerprint);
  }
  template <class T>
  void number(T value) {
    big_endian(value, grow(sizeof(T)));
  }
  template <class Enumeration>
  void enumeration(Enumeration value) {
    number(static_cast<std::int8_t>(value));
  }
  void boolean(bool value) { number(static_cast<std::int8_t>(value)); }
  void count(std::size_t n) { number(static_cast<std::int32_t>(n)); }
  void vector(const Eigen::Vector3d& v) {
    for (int i = 0; i < 3; ++i) number(v[i]);
  }
  /// w, x, y, z with w >= 0: of the two quaternions of a rotation always the same one.
  void orientation(const Eigen::Quaterniond& q);
  /// Up to the first NUL, which ends a string on the wire.
  void text(std::string_view text);
  void raw(Bytes raw) { bytes_.insert(bytes_.end(), raw.begin(), raw.end()); }
  void floats(std::span<const float> values);
  /// utime and the nanoseconds within it.
  template <class Clock>
  void nanosecond_stamp(Stamp<Clock> stamp) {
    number(stamp.utime());
    number(static_cast<std::int16_t>(stamp.ns - stamp.utime() * 1000));
  }

 private:
  std::uint8_t* grow(std::size_t n) {
    bytes_.resize(bytes_.size() + n);
    return bytes_.data() + bytes_.size() - n;
  }
  std::vector<std::uint8_t>& bytes_;
};

/// At most 40 letters, digits, '_' and '-': what may be part of MR_AGENT_<name>_CAMERA, which must stay
/// within the 63 bytes of an LCM channel.
bool is_name(std::string_view name);

/// "0x1f317af1246276ac"
std::string hex(std::int64_t fingerprint);

}  // namespace parhelion::wire
