#include "server/training/database.hpp"

#include <fcntl.h>
#include <sqlite3.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <map>
#include <tuple>

namespace parhelion::training {
namespace {

sqlite3_stmt* statement_of(void* row) { return static_cast<sqlite3_stmt*>(row); }

struct Finalize {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Prepared = std::unique_ptr<sqlite3_stmt, Finalize>;

std::string advice(int code, const char* message) {
  switch (code & 0xff) {
    case SQLITE_FULL:
      return "the disk is full; nothing was stored, earlier content is intact: free space and "
             "try again";
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return "another program used it for too long; nothing was stored: try again";
    case SQLITE_NOTADB:
      return "is not an SQLite database; expected the records of trainees, as 'parhelion records add' "
             "creates them";
    case SQLITE_CORRUPT:
      return std::string("is damaged (") + message + "): restore a copy of it";
    case SQLITE_READONLY:
    case SQLITE_PERM:
    case SQLITE_AUTH:
      return "is not writable: check the permissions of the file and its folder";
    case SQLITE_CANTOPEN:
      return std::string("cannot be opened (") + message + "): check the folder and its permissions";
    case SQLITE_IOERR:
      return std::string("cannot be read or written (") + message + "); nothing was stored: check the disk";
    default:
      return message;
  }
}

int bind(sqlite3_stmt* statement, int index, const SqlValue& value) {
  if (const auto* integer = std::get_if<std::int64_t>(&value))
    return sqlite3_bind_int64(statement, index, *integer);
  if (const auto* real = std::get_if<double>(&value)) return sqlite3_bind_double(statement, index, *real);
  if (const auto* text = std::get_if<std::string>(&value))
    return sqlite3_bind_text64(statement, index, text->data(), text->size(), SQLITE_TRANSIENT, SQLITE_UTF8);
  return sqlite3_bind_null(statement, index);
}

/// Restricts access at creation, so that the file is never readable by others.
Status make_private(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (file < 0) return Error{path + ": cannot be made: " + std::strerror(errno)};
  ::close(file);
  return {};
}

}  // namespace

bool SqlRow::null(int column) const {
  return sqlite3_column_type(statement_of(statement_), column) == SQLITE_NULL;
}
std::int64_t SqlRow::integer(int column) const {
  return sqlite3_column_int64(statement_of(statement_), column);
}
double SqlRow::real(int column) const { return sqlite3_column_double(statement_of(statement_), column); }
std::string SqlRow::text(int column) const {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement_of(statement_), column));
  if (text == nullptr) return {};
  return {text, static_cast<std::size_t>(sqlite3_column_bytes(statement_of(statement_), column))};
}

struct Database::State {
  std::string path;
  sqlite3* handle = nullptr;
  std::map<std::string, Prepared> statements;

  ~State() {
    statements.clear();
    sqlite3_close(handle);
  }
  Error error(int code) const { return Error{path + ": " + advice(code, sqlite3_errmsg(handle))}; }

  Result<sqlite3_stmt*> prepare(const std::string& sql, const std::vector<SqlValue>& values) {
    Prepared& prepared = statements[sql];
    if (!prepared) {
      sqlite3_stmt* made = nullptr;
      const int code = sqlite3_prepare_v3(handle, sql.c_str(), -1, SQLITE_PREPARE_PERSISTENT, &made, nullptr);
      prepared.reset(made);
      if (code != SQLITE_OK) return error(code);
    }
    for (std::size_t i = 0; i < values.size(); ++i)
      if (const int code = bind(prepared.get(), static_cast<int>(i) + 1, values[i]); code != SQLITE_OK)
        return error(code);
    return prepared.get();
  }
};

Database::Database(std::unique_ptr<State> state) : state_(std::move(state)) {}
Database::Database(Database&&) noexcept = default;
Database& Database::operator=(Database&&) noexcept = default;
Database::~Database() = default;

Result<Database> Database::open(const std::string& path, bool create, int patience_ms) {
  if (!create && access(path.c_str(), F_OK) != 0)
    return Error{path + ": there are no records; create them with 'parhelion records add NAME'"};
  if (create)
    if (const Status made = make_private(path); !made) return made.error();
  auto state = std::make_unique<State>();
  state->path = path;
  const int opened =
      sqlite3_open_v2(path.c_str(), &state->handle, SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX, nullptr);
  if (opened != SQLITE_OK) return state->error(opened);
  sqlite3_extended_result_codes(state->handle, 1);
  sqlite3_busy_timeout(state->handle, patience_ms);
  Database database(std::move(state));
  const Status set = database.execute(
      "PRAGMA synchronous=FULL; PRAGMA foreign_keys=ON; PRAGMA secure_delete=ON; PRAGMA temp_store=MEMORY;"
      "PRAGMA trusted_schema=OFF;");
  if (!set) return set.error();
  return database;
}

Status Database::write_ahead() {
  std::string mode;
  const Status set = each("PRAGMA journal_mode=WAL", {}, [&](const SqlRow& row) {
    mode = row.text(0);
    return Status();
  });
  if (set && mode != "wal")
    return Error{path() + ": its file system does not support a write-ahead log; put it on a local disk"};
  return set;
}

const std::string& Database::path() const { return state_->path; }

Status Database::execute(const char* script) {
  const int code = sqlite3_exec(state_->handle, script, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) return state_->error(code);
  return {};
}

Status Database::run(const std::string& sql, const std::vector<SqlValue>& values) {
  return each(sql, values, [](const SqlRow&) { return Status(); });
}

Status Database::each(const std::string& sql, const std::vector<SqlValue>& values,
                      const std::function<Status(const SqlRow&)>& take) {
  const auto statement = state_->prepare(sql, values);
  if (!statement) return statement.error();
  Status status;
  int code = SQLITE_ROW;
  while (status && (code = sqlite3_step(*statement)) == SQLITE_ROW) status = take(SqlRow(*statement));
  if (status && code != SQLITE_DONE) status = state_->error(code);
  sqlite3_reset(*statement);
  sqlite3_clear_bindings(*statement);
  return status;
}

Result<std::optional<std::int64_t>> Database::number(const std::string& sql,
                                                     const std::vector<SqlValue>& values) {
  std::optional<std::int64_t> found;
  const Status read = each(sql, values, [&](const SqlRow& row) {
    if (!found) found = row.integer(0);
    return Status();
  });
  if (!read) return read.error();
  return found;
}

Status Database::write(const std::function<Status()>& work) { return transaction("BEGIN IMMEDIATE", work); }
Status Database::read(const std::function<Status()>& work) { return transaction("BEGIN", work); }

Status Database::transaction(const char* begin, const std::function<Status()>& work) {
  if (sqlite3_get_autocommit(state_->handle) == 0) return work();
  if (const Status begun = run(begin); !begun) return begun;
  Status done = work();
  if (done) done = run("COMMIT");
  // On a full disk SQLite may have rolled back already.
  if (!done && sqlite3_get_autocommit(state_->handle) == 0) std::ignore = run("ROLLBACK");
  return done;
}

std::int64_t Database::inserted_id() const { return sqlite3_last_insert_rowid(state_->handle); }

Status Database::empty_log() {
  const auto busy = number("PRAGMA wal_checkpoint(TRUNCATE)");
  if (!busy) return busy.error();
  if (busy->value_or(0) != 0)
    return Error{path() + ": another program is reading, so the old content is still in " + path() + "-wal"};
  return {};
}

}  // namespace parhelion::training
