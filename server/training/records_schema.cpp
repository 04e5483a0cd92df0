#include "server/training/records_schema.hpp"

#include <iterator>

namespace parhelion::training {
namespace {

// Instants are SimulationTime, ns since the epoch. Only trainees.name and trainees.mbox_sha1sum are personal.
// Released steps never change: add new ones at the end.
constexpr const char* kSteps[] = {
    R"(
CREATE TABLE trainees(id INTEGER PRIMARY KEY AUTOINCREMENT, pseudonym TEXT NOT NULL UNIQUE, name TEXT UNIQUE,
  mbox_sha1sum TEXT UNIQUE) STRICT;
CREATE TABLE sessions(id INTEGER PRIMARY KEY AUTOINCREMENT,
  trainee INTEGER NOT NULL REFERENCES trainees ON DELETE CASCADE, identity TEXT NOT NULL UNIQUE,
  scenario TEXT NOT NULL, programme TEXT NOT NULL, level INTEGER NOT NULL, robot TEXT NOT NULL,
  log TEXT NOT NULL, skipped_bytes INTEGER NOT NULL, begin_ns INTEGER NOT NULL, end_ns INTEGER NOT NULL) STRICT;
CREATE INDEX sessions_of_trainee ON sessions(trainee);
CREATE TABLE scores(session INTEGER PRIMARY KEY REFERENCES sessions ON DELETE CASCADE, score REAL NOT NULL,
  awarded REAL NOT NULL, deducted REAL NOT NULL, max REAL NOT NULL, fraction REAL NOT NULL, grade TEXT NOT NULL,
  passed INTEGER NOT NULL, ended INTEGER NOT NULL, complete INTEGER NOT NULL) STRICT;
CREATE TABLE events(id INTEGER PRIMARY KEY, session INTEGER NOT NULL REFERENCES sessions ON DELETE CASCADE,
  at_ns INTEGER NOT NULL, kind TEXT NOT NULL, subject TEXT NOT NULL, object TEXT NOT NULL,
  pair INTEGER NOT NULL, x REAL NOT NULL, y REAL NOT NULL, z REAL NOT NULL, impulse REAL NOT NULL,
  value REAL NOT NULL, undetectable INTEGER NOT NULL, request INTEGER NOT NULL, text TEXT NOT NULL) STRICT;
CREATE INDEX events_of_session ON events(session);
CREATE TABLE tasks(session INTEGER NOT NULL REFERENCES sessions ON DELETE CASCADE, position INTEGER NOT NULL,
  name TEXT NOT NULL, required INTEGER NOT NULL, outcome TEXT NOT NULL, points REAL NOT NULL,
  began_ns INTEGER, ended_ns INTEGER, cause INTEGER REFERENCES events,
  PRIMARY KEY(session, position)) STRICT, WITHOUT ROWID;
CREATE TABLE deductions(session INTEGER NOT NULL REFERENCES sessions ON DELETE CASCADE, position INTEGER NOT NULL,
  at_ns INTEGER NOT NULL, rule TEXT NOT NULL, points REAL NOT NULL, cause INTEGER REFERENCES events,
  PRIMARY KEY(session, position)) STRICT, WITHOUT ROWID;
-- A row: something was erased, but its bytes may still be in the files.
CREATE TABLE erasures(id INTEGER PRIMARY KEY) STRICT;
PRAGMA application_id = 1349675116;  -- 'Prhl'
)",
    // The skills of each task, so that they can be estimated without its scenario.
    R"(
CREATE TABLE skills(session INTEGER NOT NULL REFERENCES sessions ON DELETE CASCADE, position INTEGER NOT NULL,
  skill TEXT NOT NULL, PRIMARY KEY(session, position, skill)) STRICT, WITHOUT ROWID;
)",
    // Indices for deleting events, which are referenced as causes.
    R"(
CREATE INDEX tasks_by_cause ON tasks(cause);
CREATE INDEX deductions_by_cause ON deductions(cause);
)",
};

constexpr std::int64_t kApplication = 1349675116;

Status refuse_foreign(Database& database) {
  // In this order: another program may make the tables, and with them the identity, in between.
  const auto tables = database.number("SELECT count(*) FROM sqlite_schema");
  if (!tables) return tables.error();
  const auto application = database.number("PRAGMA application_id");
  if (!application) return application.error();
  if (application->value_or(0) == kApplication || tables->value_or(0) == 0) return {};
  return Error{database.path() +
               ": is a database of another program; expected the records of trainees, as 'parhelion records "
               "add' creates them"};
}

Result<std::int64_t> schema_of(Database& database) {
  const auto found = database.number("PRAGMA user_version");
  if (!found) return found.error();
  const std::int64_t schema = found->value_or(0);
  if (schema >= 0 && schema <= newest_schema()) return schema;
  return Error{database.path() + ": has schema version " + std::to_string(schema) +
               "; this program supports versions up to " + std::to_string(newest_schema()) +
               ": use the newer parhelion that wrote it"};
}

}  // namespace

std::int64_t newest_schema() { return std::ssize(kSteps); }

Status migrate(Database& database, std::int64_t target) {
  if (const Status ours = refuse_foreign(database); !ours) return ours;
  while (true) {
    auto schema = schema_of(database);
    if (!schema) return schema.error();
    if (*schema >= target) return {};
    const Status stepped = database.write([&]() -> Status {
      schema = schema_of(database);  // another program may have migrated it meanwhile
      if (!schema) return schema.error();
      if (*schema >= target) return {};
      if (const Status done = database.execute(kSteps[*schema]); !done) return done;
      return database.execute(("PRAGMA user_version = " + std::to_string(*schema + 1)).c_str());
    });
    if (!stepped) return stepped;
  }
}

}  // namespace parhelion::training
