#include "protocols/yaml/base64.hpp"

#include <yaml-cpp/binary.h>

#include <array>

namespace parhelion::yaml {
namespace {

constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr std::uint8_t kInvalid = 64;

constexpr std::array<std::uint8_t, 256> value_of_character() {
  std::array<std::uint8_t, 256> values{};
  for (std::uint8_t& value : values) value = kInvalid;
  for (std::size_t i = 0; i < kAlphabet.size(); ++i)
    values[static_cast<unsigned char>(kAlphabet[i])] = static_cast<std::uint8_t>(i);
  return values;
}

bool is_space(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }

Error error_at(std::size_t offset, const std::string& words) {
  return {"base64, character " + std::to_string(offset) + ": " + words};
}

}  // namespace

std::string to_base64(std::span<const std::uint8_t> bytes) {
  return YAML::EncodeBase64(bytes.data(), bytes.size());
}

Result<std::vector<std::uint8_t>> from_base64(std::string_view text) {
  static constexpr auto values = value_of_character();
  std::vector<std::uint8_t> bytes;
  bytes.reserve(text.size() / 4 * 3);
  std::uint32_t group = 0;
  int characters = 0, padding = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (is_space(text[i])) continue;
    const std::uint8_t value = values[static_cast<unsigned char>(text[i])];
    if (text[i] == '=') {
      if (characters < 2) return error_at(i, "padding (=) where a character is expected");
      ++padding;
    } else if (padding > 0) {
      return error_at(i, "text after the padding (=)");
    } else if (value == kInvalid) {
      return error_at(i, "not one of A-Z, a-z, 0-9, + and /");
    }
    group = group << 6U | (text[i] == '=' ? 0U : value);
    if (++characters < 4) continue;
    for (int k = 0; k < 3 - padding; ++k) bytes.push_back(static_cast<std::uint8_t>(group >> (16 - 8 * k)));
    if (padding > 0 && (group & ((1U << (8 * padding)) - 1)) != 0)
      return error_at(i, "bits are left over before the padding (=)");
    // A group with padding is the last: anything after it is an error, found above at its first character.
    characters = padding > 0 ? 4 : 0;
    group = 0;
    if (characters == 4 && padding > 2) return error_at(i, "more than two characters of padding (=)");
  }
  if (characters != 0 && characters != 4)
    return error_at(text.size(), "the text ends within a group of four characters");
  return bytes;
}

}  // namespace parhelion::yaml
