#include "server/station/foxglove/json_text.hpp"

#include <charconv>
#include <cmath>

#include "protocols/yaml/utf8.hpp"

namespace parhelion::station::foxglove {
namespace {

template <class Number>
void append(std::string& text, Number value) {
  char digits[32];
  text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

template <class Number>
void append_real(std::string& text, Number value) {
  if (std::isfinite(value))
    append(text, value);
  else
    text += value < 0 ? "-1e999" : "1e999";
}

}  // namespace

void JsonText::separate() {
  if (!first_) text_ += ',';
  first_ = false;
}

JsonText& JsonText::open(char bracket) {
  separate();
  text_ += bracket;
  first_ = true;
  return *this;
}

JsonText& JsonText::close(char bracket) {
  text_ += bracket;
  first_ = false;
  return *this;
}

JsonText& JsonText::key(std::string_view name) {
  string(name);
  text_ += ':';
  first_ = true;
  return *this;
}

JsonText& JsonText::number(double value) { return separate(), append_real(text_, value), *this; }
JsonText& JsonText::number(float value) { return separate(), append_real(text_, value), *this; }
JsonText& JsonText::integer(std::int64_t value) { return separate(), append(text_, value), *this; }
JsonText& JsonText::boolean(bool value) { return separate(), text_ += value ? "true" : "false", *this; }

JsonText& JsonText::raw(std::string_view json) { return separate(), text_ += json, *this; }

JsonText& JsonText::string(std::string_view value) {
  separate();
  text_ += '"';
  const bool utf8 = !yaml::find_invalid_utf8(value);
  for (const char letter : value) {
    const auto byte = static_cast<unsigned char>(letter);
    if (letter == '"' || letter == '\\') {
      text_ += '\\';
      text_ += letter;
    } else if (byte < 0x20) {
      constexpr char digits[] = "0123456789abcdef";
      text_ += "\\u00";
      text_ += digits[byte >> 4];
      text_ += digits[byte & 15];
    } else {
      text_ += byte >= 0x80 && !utf8 ? '?' : letter;
    }
  }
  text_ += '"';
  return *this;
}

JsonText& JsonText::unescaped(std::string_view value) {
  separate();
  text_ += '"';
  text_ += value;
  text_ += '"';
  return *this;
}

JsonText& JsonText::time(std::int64_t ns) {
  constexpr std::int64_t second = 1'000'000'000;
  return open('{').key("sec").integer(ns / second).key("nsec").integer(ns % second).close('}');
}

JsonText& JsonText::vector(const Eigen::Vector3d& v) {
  return open('{').key("x").number(v.x()).key("y").number(v.y()).key("z").number(v.z()).close('}');
}

JsonText& JsonText::quaternion(const Eigen::Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  open('{').key("x").number(q.x()).key("y").number(q.y());
  return key("z").number(q.z()).key("w").number(q.w()).close('}');
}

JsonText& JsonText::pose(const Eigen::Isometry3d& T) {
  open('{').key("position").vector(T.translation());
  return key("orientation").quaternion(T.linear()).close('}');
}

}  // namespace parhelion::station::foxglove
