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

}  // namespace

struct BagDatabase::State {
  std::string path;
  sqlite3* database = nullptr;
  sqlite3_stmt* rows = nullptr;
  std::map<std::int64_t, Topic> topics;
  std::vector<std::uint8_t> inflated;
  std::uint64_t messages = 0;
  double bytes = 0, share = 0;  ///< of the file, and of it for a message
  bool ended = false;

  ~State() {
    sqlite3_finalize(rows);
    sqlite3_close(database);
  }
  Error error(const std::string& what) const {
    return Error{path + ": " + what + ": " + sqlite3_errmsg(database)};
  }
  sqlite3_stmt* prepare(const char* sql) const {
    sqlite3_stmt* statement = nullptr;
    sqlite3_prepare_v2(database, sql, -1, &statement, nullptr);
    return statement;
  }
  Status check_tables() const;
  Status read_topics();
  Result<bool> give(BagMessage& message);
};

/// Views could compute without end.
Status BagDatabase::State::check_tables() const {
  sqlite3_stmt* count =
      prepare("SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name IN ('topics', 'messages')");
  const bool both =
      count != nullptr && sqlite3_step(count) == SQLITE_ROW && sqlite3_column_int(count, 0) == 2;
  sqlite3_finalize(count);
  return both ? Status() : Status(error("not a database of rosbag2: no tables 'topics' and 'messages'"));
}

Status BagDatabase::State::read_topics() {
  sqlite3_stmt* each = prepare("SELECT id, name, type, serialization_format FROM topics");
  if (each == nullptr) return error("not a database of rosbag2");
  while (sqlite3_step(each) == SQLITE_ROW) {
    topics[sqlite3_column_int64(each, 0)] = {text_of(each, 1), ros2_type(text_of(each, 2), text_of(each, 3))};
  }
  const bool read = sqlite3_finalize(each) == SQLITE_OK;
  return read ? Status() : error("its topics cannot be read");
}

Result<bool> BagDatabase::State::give(BagMessage& message) {
  const std::int64_t topic = sqlite3_column_int64(rows, 0);
  const auto known = topics.find(topic);
  const auto fault = [&](const std::string& what) {
    return Error{path + ": message " + std::to_string(messages + 1) + ": " + what};
  };
  const std::int64_t received = sqlite3_column_int64(rows, 1);
  if (received < 0) return fault("a receive time before 1970");
  if (known == topics.end()) return fault("of a topic that is not listed, " + std::to_string(topic));
  const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(rows, 2));
  std::span<const std::uint8_t> bytes(data, static_cast<std::size_t>(sqlite3_column_bytes(rows, 2)));
  if (is_zstd(bytes)) {
    if (const Status done = inflate_message(bytes, inflated); !done) return fault(done.error().message);
    bytes = inflated;
  }
  message.topic = known->second.name;
  message.type = known->second.type;
  message.received = {received};
  message.number = ++messages;
  message.bytes = {bytes, ros::Encoding::cdr};
  return true;
}

BagDatabase::BagDatabase(std::unique_ptr<State> state) : state_(std::move(state)) {}
BagDatabase::~BagDatabase() = default;

Result<std::unique_ptr<BagSource>> BagDatabase::open(const std::filesystem::path& path) {
  auto state = std::make_unique<State>();
  state->path = path.string();
  // Immutable: SQLite would otherwise write beside it if it has a write-ahead log.
  std::error_code failed;
  const std::string whole = std::filesystem::absolute(path, failed).lexically_normal().string();
  const std::string uri = "file://" + escaped(whole) + "?immutable=1";
  if (sqlite3_open_v2(uri.c_str(), &state->database, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr) !=
      SQLITE_OK)
    return state->error("cannot be opened");
  // Names that a file's views or triggers use run nothing.
  sqlite3_db_config(state->database, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  if (const Status tables = state->check_tables(); !tables) return tables.error();
  std::error_code ignored;
  state->bytes = static_cast<double>(std::filesystem::file_size(path, ignored));
  if (Status topics = state->read_topics(); !topics) return topics.error();
  if (sqlite3_stmt* count = state->prepare("SELECT count(*) FROM messages"); count != nullptr) {
    if (sqlite3_step(count) == SQLITE_ROW)
      state->share = state->bytes / std::max(1.0, sqlite3_column_double(count, 0));
    sqlite3_finalize(count);
  }
  state->rows = state->prepare("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp, id");
  if (state->rows == nullptr) return state->error("not a database of rosbag2");
  return std::unique_ptr<BagSource>(new BagDatabase(std::move(state)));
}

Result<bool> BagDatabase::next(BagMessage& message) {
  State& s = *state_;
  if (s.ended) return false;
  const int code = sqlite3_step(s.rows);
  if (code == SQLITE_ROW) return s.give(message);
  s.ended = true;
  if (code == SQLITE_DONE) return false;
  return s.error("damaged behind message " + std::to_string(s.messages) + "; nothing more is read");
}

std::uint64_t BagDatabase::messages() const { return state_->messages; }
double BagDatabase::done() const { return state_->share * static_cast<double>(state_->messages); }
double BagDatabase::total() const { return state_->bytes; }

}  // namespace parhelion::tools
