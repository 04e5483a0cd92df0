// An SQLite database. Only database.cpp uses SQLite.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "protocols/status.hpp"

namespace parhelion::training {

/// Value of a column; monostate: NULL.
using SqlValue = std::variant<std::monostate, std::int64_t, double, std::string>;

template <class T>
SqlValue sql_or_null(const std::optional<T>& value) {
  return value ? SqlValue(*value) : SqlValue();
}

/// The current row of a query; columns count from 0. NULL reads as 0 and as an empty text.
class SqlRow {
 public:
  explicit SqlRow(void* statement) : statement_(statement) {}
  bool null(int column) const;
  std::int64_t integer(int column) const;
  double real(int column) const;
  std::string text(int column) const;

 private:
  void* statement_;
};

/// synchronous=FULL: with the write-ahead log, a completed write() survives kill -9 and a power cut. Deleted
/// content is overwritten with zeros. Waits up to `patience` for concurrent writers. Not thread-safe. Every
/// Error names the file and a remedy.
class Database {
 public:
  /// A created file is accessible only to its owner (0600).
  static Result<Database> open(const std::string& path, bool create, int patience_ms);
  Database(Database&&) noexcept;
  Database& operator=(Database&&) noexcept;
  ~Database();

  const std::string& path() const;
  /// Enables the write-ahead log; the setting is stored in the file.
  Status write_ahead();
  /// Several statements without values: schemas and pragmas.
  Status execute(const char* script);
  /// One statement, prepared once and cached; each `?` takes one value.
  Status run(const std::string& sql, const std::vector<SqlValue>& values = {});
  /// Calls `take` for each row until it fails. `take` may run queries, but not with the same text.
  Status each(const std::string& sql, const std::vector<SqlValue>& values,
              const std::function<Status(const SqlRow&)>& take);
  /// The first column of the first row as a number; nullopt: there is no row.
  Result<std::optional<std::int64_t>> number(const std::string& sql,
                                             const std::vector<SqlValue>& values = {});
  /// Transaction: all writes of `work`, or none if it fails. Nested in another write() it is part of that
  /// one.
  Status write(const std::function<Status()>& work);
  /// All queries of `work` see the same state, despite concurrent writers.
  Status read(const std::function<Status()>& work);
  /// The row id of the newest insert.
  std::int64_t inserted_id() const;
  /// Moves all of the write-ahead log into the database and empties it. Error: another program is reading.
  Status empty_log();

 private:
  struct State;
  Status transaction(const char* begin, const std::function<Status()>& work);
  explicit Database(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::training
