// A ROS 1 bag written by hand: for messages that no available recording contains.
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/tools/imported_log.hpp"

namespace parhelion::test {

/// Serializes like ROS.
class RosBytes {
 public:
  template <class T>
  RosBytes& add(T value) {
    const auto* bytes = reinterpret_cast<const char*>(&value);
    bytes_.append(bytes, sizeof value);
    return *this;
  }
  RosBytes& text(const std::string& value) {
    return add(static_cast<std::uint32_t>(value.size())).raw(value);
  }
  RosBytes& raw(const std::string& value) {
    bytes_ += value;
    return *this;
  }
  template <class T>
  RosBytes& array(const std::vector<T>& values) {
    add(static_cast<std::uint32_t>(values.size()));
    for (const T& value : values) add(value);
    return *this;
  }
  RosBytes& doubles(std::initializer_list<double> values) {
    for (const double value : values) add(value);
    return *this;
  }
  RosBytes& header(std::uint32_t seconds, std::uint32_t ns, const std::string& frame) {
    return add(std::uint32_t{0}).add(seconds).add(ns).text(frame);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

class WrittenBag {
 public:
  void add(const std::string& topic, const std::string& type, std::uint32_t seconds,
           const RosBytes& message) {
    const auto [known, is_new] = connections_.emplace(topic, static_cast<std::uint32_t>(connections_.size()));
    if (is_new) {
      const std::string about = field("topic", topic) + field("type", type) + field("md5sum", "*");
      chunk_ +=
          record(field("op", "\x07") + field("conn", number(known->second)) + field("topic", topic), about);
    }
    const std::string time = number(seconds) + number(5000);
    chunk_ += record(field("op", "\x02") + field("conn", number(known->second)) + field("time", time),
                     message.bytes());
  }
  /// `pack` compresses the chunk as its field `compression` says.
  void write(const std::filesystem::path& path, const std::string& compression = "none",
             std::string (*pack)(const std::string&) = nullptr) const {
    const std::string size = number(static_cast<std::uint32_t>(chunk_.size()));
    write_text(path, "#ROSBAG V2.0\n" + record(field("op", "\x03"), std::string(100, ' ')) +
                         record(field("compression", compression) + field("op", "\x05") + field("size", size),
                                pack == nullptr ? chunk_ : pack(chunk_)));
  }

 private:
  static std::string number(std::uint32_t value) {
    return {reinterpret_cast<const char*>(&value), sizeof value};
  }
  static std::string sized(const std::string& bytes) {
    return number(static_cast<std::uint32_t>(bytes.size())) + bytes;
  }
  static std::string field(const std::string& name, const std::string& value) {
    return sized(name + "=" + value);
  }
  static std::string record(const std::string& header, const std::string& data) {
    return sized(header) + sized(data);
  }

  std::map<std::string, std::uint32_t> connections_;
  std::string chunk_;
};

}  // namespace parhelion::test
