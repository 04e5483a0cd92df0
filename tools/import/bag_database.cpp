#include "tools/import/bag_database.hpp"

#include <sqlite3.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "tools/import/ros2_names.hpp"
#include "tools/import/zstd_data.hpp"

namespace parhelion::tools {
namespace {

struct Topic {
  std::string name, type;
};

std::string text_of(sqlite3_stmt* row, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
  return text == nullptr ? "" : text;
}

/// A name as part of SQLite's URI.
std::string escaped(const std::string& path) {
  std::string text;
  for (const char c : path) {
    if (c == '%' || c == '?' || c == '#') {
      constexpr const char* digits = "0123456789ABCDEF";
      text += {'%', digits[static_cast<unsigned char>(c) >> 4U], digits[static_cast<unsigned char>(c) & 15U]};
    } else {
      text += c;
    }
  }
  return text;
}

class BagDatabase final : public BagSource {
 public:
  explicit BagDatabase(std::string name) : path_(std::move(name)) {}
  BagDatabase(const BagDatabase&) = delete;
  BagDatabase& operator=(const BagDatabase&) = delete;
  ~BagDatabase() override {
    sqlite3_finalize(rows_);
    sqlite3_close(database_);
  }

  Status open();
  Result<bool> next(BagMessage& message) override;
  std::uint64_t messages() const override { return count_; }
  double done() const override { return bytes_per_message_ * static_cast<double>(count_); }
  double total() const override { return bytes_; }

 private:
  Error error(const std::string& what) const {
    return Error{path_ + ": " + what + ": " + sqlite3_errmsg(database_)};
  }
  sqlite3_stmt* prepare(const char* sql) const {
    sqlite3_stmt* statement = nullptr;
    sqlite3_prepare_v2(database_, sql, -1, &statement, nullptr);
    return statement;
  }
  Status check_tables() const;
  Status read_topics();
  Result<bool> give(BagMessage& message);

  const std::string path_;
  sqlite3* database_ = nullptr;
  sqlite3_stmt* rows_ = nullptr;
  std::map<std::int64_t, Topic> topics_;
  std::vector<std::uint8_t> inflated_;
  std::uint64_t count_ = 0;                   ///< messages read so far
  double bytes_ = 0, bytes_per_message_ = 0;  ///< of the file
  bool ended_ = false;
};

/// Views could compute without end.
Status BagDatabase::check_tables() const {
  sqlite3_stmt* found =
      prepare("SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name IN ('topics', 'messages')");
  const bool both =
      found != nullptr && sqlite3_step(found) == SQLITE_ROW && sqlite3_column_int(found, 0) == 2;
  sqlite3_finalize(found);
  return both ? Status()
              : Status(error("not a database of rosbag2: no tables 'topics' and 'messages' (if a file " +
                             path_ + "-wal belongs to it, it must be in the same folder)"));
}

Status BagDatabase::read_topics() {
  sqlite3_stmt* each = prepare("SELECT id, name, type, serialization_format FROM topics");
  if (each == nullptr) return error("not a database of rosbag2");
  while (sqlite3_step(each) == SQLITE_ROW) {
    topics_[sqlite3_column_int64(each, 0)] = {text_of(each, 1),
                                              ros2_type(text_of(each, 2), text_of(each, 3))};
  }
  const bool read = sqlite3_finalize(each) == SQLITE_OK;
  return read ? Status() : error("its topics cannot be read");
}

Result<bool> BagDatabase::give(BagMessage& message) {
  const std::int64_t topic = sqlite3_column_int64(rows_, 0);
  const auto known = topics_.find(topic);
  const auto fault = [&](const std::string& what) {
    return Error{path_ + ": message " + std::to_string(count_ + 1) + ": " + what};
  };
  const std::int64_t received = sqlite3_column_int64(rows_, 1);
  if (received < 0) return fault("a receive time before 1970");
  if (known == topics_.end()) return fault("of a topic that is not listed, " + std::to_string(topic));
  const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(rows_, 2));
  std::span<const std::uint8_t> blob(data, static_cast<std::size_t>(sqlite3_column_bytes(rows_, 2)));
  if (is_zstd(blob)) {
    if (const Status done = inflate_message(blob, inflated_); !done) return fault(done.error().message);
    blob = inflated_;
  }
  message.topic = known->second.name;
  message.type = known->second.type;
  message.received = {received};
  message.number = ++count_;
  message.bytes = {blob, ros::Encoding::cdr};
  return true;
}

Status BagDatabase::open() {
  std::error_code failed;
  const std::string whole = std::filesystem::absolute(path_, failed).lexically_normal().string();
  // A recorder that was killed leaves its last messages in a write-ahead log. To read it SQLite writes an
  // index beside it (-shm). Without a log the database is immutable, so that nothing is written.
  const auto log_bytes = std::filesystem::file_size(whole + "-wal", failed);
  const bool has_log = !failed && log_bytes > 0;
  const std::string uri = "file://" + escaped(whole) + (has_log ? "" : "?immutable=1");
  if (sqlite3_open_v2(uri.c_str(), &database_, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr) != SQLITE_OK)
    return error("cannot be opened");
  // What a strange file defines runs no function with side effects.
  sqlite3_db_config(database_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  if (Status tables = check_tables(); !tables) return tables;
  if (Status read = read_topics(); !read) return read;
  bytes_ = static_cast<double>(std::filesystem::file_size(path_, failed));
  if (sqlite3_stmt* all = prepare("SELECT count(*) FROM messages"); all != nullptr) {
    if (sqlite3_step(all) == SQLITE_ROW)
      bytes_per_message_ = bytes_ / std::max(1.0, sqlite3_column_double(all, 0));
    sqlite3_finalize(all);
  }
  rows_ = prepare("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp, id");
  return rows_ == nullptr ? Status(error("not a database of rosbag2")) : Status();
}

Result<bool> BagDatabase::next(BagMessage& message) {
  if (ended_) return false;
  const int code = sqlite3_step(rows_);
  if (code == SQLITE_ROW) return give(message);
  ended_ = true;
  if (code == SQLITE_DONE) return false;
  return error("damaged behind message " + std::to_string(count_) + "; nothing more is read");
}

}  // namespace

Result<std::unique_ptr<BagSource>> open_bag_database(const std::filesystem::path& path) {
  auto bag = std::make_unique<BagDatabase>(path.string());
  if (const Status opened = bag->open(); !opened) return opened.error();
  return std::unique_ptr<BagSource>(std::move(bag));
}

}  // namespace parhelion::tools
