// One SQLite database. Only database.cpp knows SQLite.
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

/// What a column holds; monostate: NULL.
using SqlValue = std::variant<std::monostate, std::int64_t, double, std::string>;

template <class T>
SqlValue sql_or_null(const std::optional<T>& value) {
  return value ? SqlValue(*value) : SqlValue();
}

/// The row that a query is at; columns count from 0. NULL reads as 0 and as an empty text.
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

/// synchronous=FULL: with the write-ahead log a write() that returned outlives kill -9 and a power cut.
/// Deleted content is overwritten with zeros. Others that write at the same time are waited for, for
/// `patience`. Not for two threads at once. Every Error names the file and says what to do.
class Database {
 public:
  /// A file that is made is its owner's alone (0600).
  static Result<Database> open(const std::string& path, bool create, int patience_ms);
  Database(Database&&) noexcept;
  Database& operator=(Database&&) noexcept;
  ~Database();

  const std::string& path() const;
  /// Turns the write-ahead log on, which stays on in the file.
  Status write_ahead();
  /// Several statements without values: schemas and pragmas.
  Status execute(const char* script);
  /// One statement, prepared once and kept; each `?` takes one value.
  Status run(const std::string& sql, const std::vector<SqlValue>& values = {});
  /// Calls `take` for each row until it fails. `take` may query, but not with the same text.
  Status each(const std::string& sql, const std::vector<SqlValue>& values,
              const std::function<Status(const SqlRow&)>& take);
  /// The first column of the first row as a number; nullopt: there is no row.
  Result<std::optional<std::int64_t>> number(const std::string& sql,
                                             const std::vector<SqlValue>& values = {});
  /// All that `work` writes, or where it fails nothing. Within another write() it is a part of that one.
  Status write(const std::function<Status()>& work);
  /// All queries of `work` see the same state, whatever others write meanwhile.
  Status read(const std::function<Status()>& work);
  /// The id that the newest insert was given.
  std::int64_t inserted_id() const;
  /// Moves everything from the write-ahead log to the database and empties it. Error: another program reads.
  Status empty_log();

 private:
  struct State;
  Status transaction(const char* begin, const std::function<Status()>& work);
  explicit Database(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::training
