#include "server/training/records.hpp"

#include <sys/random.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <tuple>

#include "protocols/nearest_name.hpp"
#include "server/training/records_schema.hpp"
#include "server/training/stored_grade.hpp"

namespace parhelion::training {
namespace {

/// Random, not derived from the name: it cannot be computed from a list of names.
Result<std::string> new_pseudonym() {
  std::array<unsigned char, 6> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    return Error{"the system has no random bytes for a pseudonym; specify one"};
  std::string pseudonym = "t-";
  for (const unsigned char byte : bytes) {
    char hex[3];
    std::snprintf(hex, sizeof hex, "%02x", byte);
    pseudonym += hex;
  }
  return pseudonym;
}

constexpr std::size_t kPseudonymLength = 14;

SqlValue or_null(const std::string& text) { return text.empty() ? SqlValue() : SqlValue(text); }

TraineeRecord trainee_of(const SqlRow& row) { return {row.text(0), row.text(1), row.text(2)}; }

Status check_trainee(const TraineeRecord& trainee) {
  for (const std::string* text : {&trainee.pseudonym, &trainee.name})
    if (text->find_first_of("\n\r") != std::string::npos || text->find('\0') != std::string::npos)
      return Error{"a trainee's name is one line of text"};
  const std::string& mbox = trainee.mbox_sha1sum;
  if (!mbox.empty() && (mbox.size() != 40 || mbox.find_first_not_of("0123456789abcdef") != std::string::npos))
    return Error{"mbox_sha1sum '" + mbox +
                 "'; expected 40 hex digits in lower case: the SHA-1 of mailto:ADDRESS"};
  return {};
}

Status check_session(const SessionRecord& session) {
  const Grade& grade = session.grade;
  const std::string which = "session '" + session.identity + "' of '" + session.scenario + "': ";
  if (session.identity.empty()) return Error{which + "it has no identity"};
  if (session.level < 0 || session.level > 3) return Error{which + "its level is not 1, 2 or 3"};
  if (grade.end < grade.begin) return Error{which + "it ends before it begins"};
  for (const double number : {grade.score, grade.awarded, grade.deducted, grade.max, grade.fraction})
    if (!std::isfinite(number)) return Error{which + "its score is not a finite number"};
  if (!session.skills.empty() && session.skills.size() != grade.tasks.size())
    return Error{which + "it lists the skills of " + std::to_string(session.skills.size()) +
                 " tasks but has " + std::to_string(grade.tasks.size())};
  return {};
}

}  // namespace

struct Records::State {
  Database database;

  /// The row of an existing trainee.
  Result<std::int64_t> row_of(const std::string& pseudonym) {
    const auto row = database.number("SELECT id FROM trainees WHERE pseudonym = ?", {pseudonym});
    if (!row) return row.error();
    if (*row) return **row;
    return Error{database.path() + ": there is no trainee '" + pseudonym + "'"};
  }

  /// Rebuilds the files without the deleted content.
  Status scrub() {
    const auto left = database.number("SELECT count(*) FROM erasures");
    if (!left) return left.error();
    if (left->value_or(0) == 0) return {};
    Status done = database.empty_log();
    if (done) done = database.run("VACUUM");
    if (done) done = database.empty_log();
    // Only after success; an interrupted erasure is repeated at the next open.
    if (done) done = database.run("DELETE FROM erasures");
    return done;
  }

  Status insert(std::int64_t trainee, const SessionRecord& session) {
    const Status inserted = database.run(
        "INSERT INTO sessions(trainee, identity, scenario, programme, level, robot, log, skipped_bytes, "
        "begin_ns, end_ns) VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        {trainee, session.identity, session.scenario, session.programme, std::int64_t{session.level},
         session.robot, session.log, static_cast<std::int64_t>(session.skipped_bytes), session.grade.begin.ns,
         session.grade.end.ns});
    if (!inserted) return inserted;
    const std::int64_t row = database.inserted_id();
    for (std::size_t i = 0; i < session.skills.size(); ++i)
      for (const std::string& skill : session.skills[i])
        if (const Status kept = database.run("INSERT INTO skills(session, position, skill) VALUES(?, ?, ?)",
                                             {row, static_cast<std::int64_t>(i), skill});
            !kept)
          return kept;
    return insert_grade(database, row, session.grade);
  }

  Error refuse_owned(std::int64_t owner) {
    std::string whose;
    const Status read =
        database.each("SELECT pseudonym FROM trainees WHERE id = ?", {owner}, [&](const SqlRow& row) {
          whose = row.text(0);
          return Status();
        });
    if (!read) return read.error();
    return Error{database.path() + ": that session belongs to another trainee: " + whose +
                 "; was the right trainee named?"};
  }

  Result<Stored> store(const std::string& pseudonym, const SessionRecord& session, bool again) {
    const auto trainee = row_of(pseudonym);
    if (!trainee) return trainee.error();
    const auto owner = database.number("SELECT trainee FROM sessions WHERE identity = ?", {session.identity});
    if (!owner) return owner.error();
    if (*owner && **owner != *trainee) return refuse_owned(**owner);
    if (*owner && !again) return Stored::present;
    if (*owner) {
      const Status gone = database.run("DELETE FROM sessions WHERE identity = ?", {session.identity});
      if (!gone) return gone.error();
    }
    if (const Status inserted = insert(*trainee, session); !inserted) return inserted.error();
    return *owner ? Stored::replaced : Stored::added;
  }

  Status read_skills(std::int64_t row, SessionRecord& session) {
    session.skills.resize(session.grade.tasks.size());
    return database.each("SELECT position, skill FROM skills WHERE session = ? ORDER BY position, skill",
                         {row}, [&](const SqlRow& found) -> Status {
                           const auto position = static_cast<std::size_t>(found.integer(0));
                           if (position < session.skills.size())
                             session.skills[position].push_back(found.text(1));
                           return {};
                         });
  }

  Status read_sessions(std::int64_t trainee, std::vector<SessionRecord>& sessions) {
    return database.each(
        "SELECT identity, scenario, programme, robot, log, level, skipped_bytes, id FROM sessions "
        "WHERE trainee = ? ORDER BY id",
        {trainee}, [&](const SqlRow& row) -> Status {
          SessionRecord& session = sessions.emplace_back();
          session = {row.text(0), row.text(1), row.text(2), row.text(3), row.text(4), 0, 0, {}, {}};
          session.level = static_cast<int>(row.integer(5));
          session.skipped_bytes = static_cast<std::uint64_t>(row.integer(6));
          auto grade = read_grade(database, row.integer(7));
          if (!grade) return grade.error();
          session.grade = std::move(*grade);
          return read_skills(row.integer(7), session);
        });
  }
};

bool is_pseudonym(const std::string& text) {
  return text.size() == kPseudonymLength && text.starts_with("t-") &&
         text.find_first_not_of("0123456789abcdef", 2) == std::string::npos;
}

Records::Records(std::unique_ptr<State> state) : state_(std::move(state)) {}
Records::Records(Records&&) noexcept = default;
Records& Records::operator=(Records&&) noexcept = default;
Records::~Records() = default;

Result<Records> Records::open(const std::string& path, bool create, int patience_ms) {
  auto database = Database::open(path, create, patience_ms);
  if (!database) return database.error();
  auto state = std::make_unique<State>(State{std::move(*database)});
  if (const Status migrated = migrate(state->database); !migrated) return migrated.error();
  if (const Status set = state->database.write_ahead(); !set) return set.error();
  // If another program is reading, the next open tries again.
  std::ignore = state->scrub();
  return Records(std::move(state));
}

Result<TraineeRecord> Records::add(TraineeRecord trainee) {
  if (trainee.pseudonym.empty()) {
    auto drawn = new_pseudonym();
    if (!drawn) return drawn.error();
    trainee.pseudonym = std::move(*drawn);
  }
  if (const Status fine = check_trainee(trainee); !fine) return fine.error();
  Database& database = state_->database;
  const Status added = database.write([&]() -> Status {
    for (const std::string* key : {&trainee.pseudonym, &trainee.name, &trainee.mbox_sha1sum}) {
      if (key->empty()) continue;
      const auto there =
          database.number("SELECT id FROM trainees WHERE ?1 IN (pseudonym, name, mbox_sha1sum)", {*key});
      if (!there) return there.error();
      if (*there) return Error{database.path() + ": there is a trainee '" + *key + "' already"};
    }
    return database.run("INSERT INTO trainees(pseudonym, name, mbox_sha1sum) VALUES(?, ?, ?)",
                        {trainee.pseudonym, or_null(trainee.name), or_null(trainee.mbox_sha1sum)});
  });
  if (!added) return added.error();
  return trainee;
}

Result<TraineeRecord> Records::find(const std::string& who) {
  std::optional<TraineeRecord> found;
  Database& database = state_->database;
  const Status read = database.each(
      "SELECT pseudonym, name, mbox_sha1sum FROM trainees WHERE ?1 IN (pseudonym, name, mbox_sha1sum)", {who},
      [&](const SqlRow& row) {
        found = trainee_of(row);
        return Status();
      });
  if (!read) return read.error();
  if (found) return *found;
  const auto all = trainees();
  if (!all) return all.error();
  std::vector<std::string> names;
  for (const TraineeRecord& trainee : *all) {
    names.push_back(trainee.pseudonym);
    if (!trainee.name.empty()) names.push_back(trainee.name);
  }
  return Error{database.path() + ": there is no trainee '" + who + "'" + suggestion(who, names) +
               "; 'parhelion records list' lists all"};
}

Result<std::vector<TraineeRecord>> Records::trainees() {
  std::vector<TraineeRecord> trainees;
  const Status read = state_->database.each("SELECT pseudonym, name, mbox_sha1sum FROM trainees ORDER BY id",
                                            {}, [&](const SqlRow& row) {
                                              trainees.push_back(trainee_of(row));
                                              return Status();
                                            });
  if (!read) return read.error();
  return trainees;
}

Status Records::erase(const std::string& pseudonym) {
  Database& database = state_->database;
  const Status deleted = database.write([&]() -> Status {
    const auto row = state_->row_of(pseudonym);
    if (!row) return row.error();
    if (const Status gone = database.run("DELETE FROM trainees WHERE id = ?", {*row}); !gone) return gone;
    return database.run("INSERT INTO erasures DEFAULT VALUES");
  });
  if (!deleted) return deleted;
  if (const Status scrubbed = state_->scrub(); !scrubbed)
    return Error{scrubbed.error().message + "; " + pseudonym +
                 " is erased, but the files are not rewritten yet: the next 'parhelion records' does so once "
                 "nothing else has them open"};
  return {};
}

Result<Records::Stored> Records::store(const std::string& pseudonym, const SessionRecord& session,
                                       bool again) {
  if (const Status fine = check_session(session); !fine) return fine.error();
  Result<Stored> stored = Error{};
  const Status written = state_->database.write([&]() -> Status {
    stored = state_->store(pseudonym, session, again);
    if (!stored) return stored.error();
    return {};
  });
  if (!written) return written.error();
  return stored;
}

Result<std::vector<SessionRecord>> Records::sessions(const std::string& pseudonym) {
  std::vector<SessionRecord> sessions;
  const Status read = state_->database.read([&]() -> Status {
    const auto trainee = state_->row_of(pseudonym);
    if (!trainee) return trainee.error();
    return state_->read_sessions(*trainee, sessions);
  });
  if (!read) return read.error();
  return sessions;
}

Status Records::together(const std::function<Status()>& work) { return state_->database.write(work); }

}  // namespace parhelion::training
