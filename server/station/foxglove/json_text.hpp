// JSON written as it goes, without a tree in between: scans and images are most of what there is.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "protocols/frames.hpp"

namespace parhelion::station::foxglove {

/// Appends members and elements with the commas between them.
class JsonText {
 public:
  /// Begins anew; the memory is used again.
  void clear() {
    text_.clear();
    first_ = true;
  }
  std::string_view text() const { return text_; }

  JsonText& open(char bracket);
  JsonText& close(char bracket);
  JsonText& key(std::string_view name);
  /// The shortest that reads back to the same bits. An infinity is `1e999`, which JSON allows and readers
  /// take for one; NaN is so, too: nothing is there.
  JsonText& number(double value);
  JsonText& number(float value);
  JsonText& integer(std::int64_t value);
  JsonText& boolean(bool value);
  /// What is no UTF-8 becomes '?'.
  JsonText& string(std::string_view value);
  /// JSON that is whole by itself.
  JsonText& raw(std::string_view json);
  /// Text that needs no escapes.
  JsonText& plain(std::string_view value);

  /// {"sec", "nsec"} of nanoseconds since the epoch.
  JsonText& time(std::int64_t ns);
  JsonText& vector(const Eigen::Vector3d& v);
  JsonText& pose(const Eigen::Isometry3d& T);
  JsonText& quaternion(const Eigen::Matrix3d& R);

 private:
  void separate();

  std::string text_;
  bool first_ = true;  ///< nothing stands before what comes next: no comma
};

}  // namespace parhelion::station::foxglove
