#include "protocols/codec_wire.hpp"

#include <algorithm>
#include <cstdio>

#include "protocols/authentication/signature.hpp"
#include "protocols/channel_map.hpp"
#include "protocols/operator_status.hpp"

namespace parhelion::wire {
namespace {

constexpr std::int64_t kUtimeOf2200 = 7'258'118'400'000'000;

bool sensible(std::int64_t utime) { return utime >= 0 && utime < kUtimeOf2200; }

}  // namespace

bool is_operator_name(std::string_view name) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  return !name.empty() && name.size() <= kMaxOperatorName && std::all_of(name.begin(), name.end(), allowed);
}

void check_agent_name(Reader& reader, const char* field, std::string_view name) {
  static_assert(kMaxRobotName == 32);
  reader.check(agent_name_fault(name).empty(), field, "a name that cannot be part of a channel",
               "1 to 32 letters, digits, '_' and '-'");
}

std::string hex(std::int64_t fingerprint) {
  char text[19];
  std::snprintf(text, sizeof text, "0x%016llx", static_cast<unsigned long long>(fingerprint));
  return text;
}

Reader::Reader(std::string_view channel, const char* type, std::int64_t fingerprint, Bytes bytes)
    : channel_(channel), type_(type), bytes_(bytes) {
  if (bytes.size() < 8) {
    fail(std::to_string(bytes.size()) + " bytes, expected at least the 8 of the fingerprint " +
         hex(fingerprint));
    return;
  }
  const auto found = number<std::int64_t>("fingerprint");
  if (found != fingerprint) {
    fail("fingerprint " + hex(found) + ", expected " + hex(fingerprint) +
         ": the sender's type has other members, or the channel is mapped wrongly");
  }
}

bool Reader::take(const char* field, std::size_t n) {
  if (!ok()) return false;
  if (bytes_.size() - at_ < n) {
    fail(std::string(field) + ": ends at byte " + std::to_string(bytes_.size()) + ", expected " +
         std::to_string(n) + " bytes from byte " + std::to_string(at_));
    return false;
  }
  at_ += n;
  return true;
}

void Reader::fail(std::string problem) {
  if (ok()) problem_ = std::move(problem);
}

void Reader::fail_value(const char* field, double value, const char* expected) {
  if (!ok()) return;
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  fail(std::string(field) + ": " + text + ", expected " + expected);
}

void Reader::check(bool good, const char* field, const char* found, const char* expected) {
  if (ok() && !good) fail(std::string(field) + ": " + found + ", expected " + expected);
}

void Reader::check_range(const char* field, std::int64_t value, std::int64_t min_value,
                         std::int64_t max_value) {
  if (!ok() || (value >= min_value && value <= max_value)) return;
  fail(std::string(field) + ": " + std::to_string(value) + ", expected " + std::to_string(min_value) + ".." +
       std::to_string(max_value));
}

Eigen::Vector3d Reader::vector(const char* field, double limit) {
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) v[i] = bounded(field, limit);
  return v;
}

Eigen::Quaterniond Reader::orientation(const char* field) {
  Eigen::Quaterniond q;
  q.w() = number<double>(field);
  q.x() = number<double>(field);
  q.y() = number<double>(field);
  q.z() = number<double>(field);
  const double length = q.norm();
  if (!(std::abs(length - 1) <= 0.01)) {
    fail_value(field, length, "a quaternion w, x, y, z of length 1");
    return Eigen::Quaterniond::Identity();
  }
  q.normalize();
  return q;
}

bool Reader::boolean(const char* field) {
  const auto value = number<std::int8_t>(field);
  check_range(field, value, 0, 1);
  return value == 1;
}

std::size_t Reader::count(const char* field, std::size_t element_size, std::size_t max_value) {
  const auto n = number<std::int32_t>(field);
  check_range(field, n, 0, static_cast<std::int64_t>(max_value));
  if (!ok()) return 0;
  const std::size_t left = bytes_.size() - at_;
  if (static_cast<std::size_t>(n) > left / element_size) {
    fail(std::string(field) + ": declares " + std::to_string(n) + " elements, but only " +
         std::to_string(left) + " bytes follow, expected at least " + std::to_string(element_size) +
         " for each");
    return 0;
  }
  return static_cast<std::size_t>(n);
}

void Reader::text(const char* field, std::string& text) {
  text.clear();
  const std::size_t with_nul = count(field, 1, INT32_MAX);
  if (!ok()) return;
  if (with_nul == 0 || !take(field, with_nul)) {
    check(false, field, "a string of length 0", "at least its closing NUL");
    return;
  }
  const auto* first = bytes_.data() + at_ - with_nul;
  const auto* nul = std::find(first, first + with_nul, 0);
  check(nul == first + with_nul - 1, field, "a string whose NUL is not at its end",
        "one NUL, as its last byte");
  if (ok()) text.assign(first, nul);
}

std::string clipped(std::string text) {
  if (text.size() <= kMaxName) return text;
  std::size_t end = kMaxName;
  constexpr std::size_t kMaxContinuation = 3;  // bytes of a character after its first
  const auto is_continuation = [&](std::size_t at) { return (text[at] & 0xC0) == 0x80; };
  while (end > kMaxName - kMaxContinuation && is_continuation(end)) --end;
  text.resize(end);
  return text;
}

void Reader::name(const char* field, std::string& text) {
  this->text(field, text);
  static_assert(kMaxName == 200);
  check(text.size() <= kMaxName, field, "too long", "at most 200 bytes");
}

void Reader::raw(const char* field, std::size_t n, std::vector<std::uint8_t>& out) {
  out.clear();
  if (!take(field, n)) return;
  const auto* first = bytes_.data() + at_ - n;
  out.assign(first, first + n);
}

void Reader::floats(const char* field, std::size_t n, std::vector<float>& out) {
  out.clear();
  if (!take(field, n * sizeof(float))) return;
  const auto* first = bytes_.data() + at_ - n * sizeof(float);
  out.resize(n);
  for (std::size_t i = 0; i < n; ++i) out[i] = big_endian<float>(first + i * sizeof(float));
}

SensorTime Reader::utime() {
  const auto utime = number<std::int64_t>("utime");
  if (ok() && !sensible(utime)) {
    fail("utime: " + std::to_string(utime) + " us, expected microseconds since 1970, before 2200");
  }
  return ok() ? SensorTime::from_utime(utime) : SensorTime{};
}

std::int64_t Reader::nanosecond_stamp() {
  const SensorTime stamp = utime();
  const auto ns = number<std::int16_t>("ns");
  check_range("ns", ns, 0, 999);
  return stamp.ns + ns;
}

Status Reader::status() {
  if (ok() && at_ != bytes_.size() && !looks_signed(bytes_.subspan(at_))) {
    fail(std::to_string(bytes_.size()) + " bytes, expected " + std::to_string(at_) + ": surplus bytes");
  }
  if (ok()) return {};
  return Error{"channel " + std::string(channel_) + ": " + type_ + ": " + problem_};
}

void Writer::orientation(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0 ? -1 : 1;
  for (const double value : {q.w(), q.x(), q.y(), q.z()}) number(sign * value);
}

void Writer::text(std::string_view text) {
  text = text.substr(0, text.find('\0'));
  count(text.size() + 1);
  std::uint8_t* at = grow(text.size() + 1);
  std::copy(text.begin(), text.end(), at);
  at[text.size()] = 0;
}

void Writer::floats(std::span<const float> values) {
  std::uint8_t* at = grow(values.size() * sizeof(float));
  for (std::size_t i = 0; i < values.size(); ++i) big_endian(values[i], at + i * sizeof(float));
}

}  // namespace parhelion::wire

namespace parhelion {

std::optional<SensorTime> leading_stamp(Bytes bytes) {
  if (bytes.size() < 16) return std::nullopt;
  const auto utime = wire::big_endian<std::int64_t>(bytes.data() + 8);
  if (!wire::sensible(utime)) return std::nullopt;
  return SensorTime::from_utime(utime);
}

}  // namespace parhelion
