// Little-endian bytes of a binary message to a page.
#pragma once

#include <bit>
#include <cstring>
#include <string>
#include <type_traits>

namespace parhelion::station {

static_assert(std::endian::native == std::endian::little, "pages read little-endian");

class ByteWriter {
 public:
  /// `size`: maximum number of bytes that will be written.
  explicit ByteWriter(std::size_t size) { bytes_.reserve(size); }
  template <class T>
  void put(T value) {
    static_assert(std::is_arithmetic_v<T>);
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    bytes_.append(raw, sizeof(T));
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

}  // namespace parhelion::station
