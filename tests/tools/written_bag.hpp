// A ROS bag written by hand, of ROS 1 or 2: for messages that no available recording contains.
#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/tools/imported_log.hpp"
#include "tools/export/mcap_writer.hpp"

namespace parhelion::test {

/// Serializes like ROS 1, and like ROS 2: numbers lie at multiples of their size, texts end with a zero, and
/// headers have no number.
class RosBytes {
 public:
  template <class T>
  RosBytes& add(T value) {
    add_ros1(value);
    add_cdr(value);
    return *this;
  }
  RosBytes& text(const std::string& value) {
    add_ros1(static_cast<std::uint32_t>(value.size()));
    add_cdr(static_cast<std::uint32_t>(value.size() + 1));
    raw(value);
    cdr_ += '\0';
    return *this;
  }
  RosBytes& raw(const std::string& value) {
    bytes_ += value;
    cdr_ += value;
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
    add_ros1(std::uint32_t{0});
    return add(seconds).add(ns).text(frame);
  }
  const std::string& bytes() const { return bytes_; }
  const std::string& cdr() const { return cdr_; }

 private:
  template <class T>
  void add_ros1(T value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  template <class T>
  void add_cdr(T value) {
    while ((cdr_.size() - 4) % sizeof value != 0) cdr_ += '\0';
    cdr_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }

  std::string bytes_, cdr_{"\0\1\0\0", 4};
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
    std::string type2 = type;
    type2.insert(type2.find('/'), "/msg");
    messages_.push_back({topic, type2, std::int64_t{seconds} * 1'000'000'000 + 5000, message.cdr()});
  }
  /// `pack` compresses the chunk as its field `compression` says.
  void write(const std::filesystem::path& path, const std::string& compression = "none",
             std::string (*pack)(const std::string&) = nullptr) const {
    const std::string size = number(static_cast<std::uint32_t>(chunk_.size()));
    write_text(path, "#ROSBAG V2.0\n" + record(field("op", "\x03"), std::string(100, ' ')) +
                         record(field("compression", compression) + field("op", "\x05") + field("size", size),
                                pack == nullptr ? chunk_ : pack(chunk_)));
  }

  /// The same of ROS 2, messages from `first` to before `last`. `pack` compresses each message.
  void write_database(const std::filesystem::path& path, std::size_t first = 0, std::size_t last = 1'000'000,
                      std::string (*pack)(const std::string&) = nullptr) const {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
    const auto run = [&](const std::string& sql) {
      ASSERT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sql;
    };
    run("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
        "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT "
        "NULL, "
        "data BLOB NOT NULL); CREATE INDEX timestamp_idx ON messages (timestamp ASC)");
    for (const auto& [topic, id] : connections_) {
      const auto of_it = std::find_if(messages_.begin(), messages_.end(),
                                      [&, name = topic](const Message& m) { return m.topic == name; });
      run("INSERT INTO topics VALUES(" + std::to_string(id + 1) + ", '" + topic + "', '" + of_it->type +
          "', 'cdr', '')");
    }
    sqlite3_stmt* insert = nullptr;
    sqlite3_prepare_v2(database, "INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)", -1,
                       &insert, nullptr);
    for (std::size_t i = first; i < std::min(last, messages_.size()); ++i) {
      const std::string bytes = pack == nullptr ? messages_[i].cdr : pack(messages_[i].cdr);
      sqlite3_bind_int64(insert, 1, connections_.at(messages_[i].topic) + 1);
      sqlite3_bind_int64(insert, 2, messages_[i].ns);
      sqlite3_bind_blob(insert, 3, bytes.data(), static_cast<int>(bytes.size()), SQLITE_TRANSIENT);
      ASSERT_EQ(sqlite3_step(insert), SQLITE_DONE);
      sqlite3_reset(insert);
    }
    sqlite3_finalize(insert);
    sqlite3_close(database);
  }
  void write_mcap(const std::filesystem::path& path, const tools::McapOptions& options = {},
                  std::string (*pack)(const std::string&) = nullptr) const {
    auto writer = tools::McapWriter::create(path.string(), options);
    ASSERT_TRUE(writer.ok());
    std::map<std::string, std::uint16_t> channels;
    for (const Message& message : messages_) {
      if (channels.count(message.topic) == 0) {
        const std::uint16_t schema = writer->add_schema(message.type, "ros2msg", "");
        channels[message.topic] = writer->add_channel(message.topic, schema, "cdr", {});
      }
      tools::McapMessage written;
      written.channel = channels[message.topic];
      written.log_time = static_cast<std::uint64_t>(message.ns);
      written.publish_time = written.log_time;
      const std::string bytes = pack == nullptr ? message.cdr : pack(message.cdr);
      written.data = bytes;
      ASSERT_TRUE(writer->write(written).ok());
    }
    ASSERT_TRUE(writer->finish().ok());
  }
  std::size_t size() const { return messages_.size(); }

 private:
  struct Message {
    std::string topic, type;
    std::int64_t ns;
    std::string cdr;
  };
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
  std::vector<Message> messages_;
};

}  // namespace parhelion::test
