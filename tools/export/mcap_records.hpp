// Fields of MCAP records: little-endian; strings and lists are preceded by their length in bytes.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace parhelion::tools::mcap {

enum class Opcode : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics = 0x0B,
  metadata = 0x0C,
  metadata_index = 0x0D,
  summary_offset = 0x0E,
  data_end = 0x0F,
};

constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

template <class Unsigned>
void put(std::string& to, Unsigned value) {
  for (std::size_t i = 0; i < sizeof value; ++i)
    to += static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i) & 0xFF);
}

inline void put_text(std::string& to, std::string_view text) {
  put(to, static_cast<std::uint32_t>(text.size()));
  to += text;
}

inline void put_texts(std::string& to, const std::map<std::string, std::string>& texts) {
  std::string pairs;
  for (const auto& [key, value] : texts) {
    put_text(pairs, key);
    put_text(pairs, value);
  }
  put_text(to, pairs);
}

/// A record: opcode, length, content.
inline void put_record(std::string& to, Opcode opcode, std::string_view content) {
  put(to, static_cast<std::uint8_t>(opcode));
  put(to, static_cast<std::uint64_t>(content.size()));
  to += content;
}

}  // namespace parhelion::tools::mcap
