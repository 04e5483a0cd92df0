// A streaming JSON writer without an intermediate tree, because scans and images are large.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "protocols/frames.hpp"

namespace parhelion::station::foxglove {

/// Appends members and elements with the commas between them.
class JsonText {
 public:
  /// Empties the text; the memory is reused.
  void clear() {
    text_.clear();
    first_ = true;
  }
  std::string_view text() const { return text_; }

  JsonText& open(char bracket);
  JsonText& close(char bracket);
  JsonText& key(std::string_view name);
  /// The shortest text that parses to the same bits. An infinity is `1e999`: valid JSON that parsers read as
  /// infinity. NaN is written so, too.
  JsonText& number(double value);
  JsonText& number(float value);
  JsonText& integer(std::int64_t value);
  JsonText& boolean(bool value);
  /// Invalid UTF-8 becomes '?'.
  JsonText& string(std::string_view value);
  /// A complete JSON value.
  JsonText& raw(std::string_view json);
  /// Text that needs no escapes.
  JsonText& unescaped(std::string_view value);

  /// {"sec", "nsec"} of nanoseconds since the epoch.
  JsonText& time(std::int64_t ns);
  JsonText& vector(const Eigen::Vector3d& v);
  JsonText& pose(const Eigen::Isometry3d& T);
  JsonText& quaternion(const Eigen::Matrix3d& R);

 private:
  void separate();

  std::string text_;
  bool first_ = true;  ///< no comma before the next value
};

}  // namespace parhelion::station::foxglove
