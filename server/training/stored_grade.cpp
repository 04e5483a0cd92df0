#include "server/training/stored_grade.hpp"

#include "protocols/enumerators.hpp"

namespace parhelion::training {
namespace {

/// Converts values up to `last`.
template <class Enum>
Result<Enum> known(const std::string& name, Enum last) {
  if (const auto found = enumerator(name, last)) return *found;
  return Error{"has a '" + name +
               "' that this version does not support: use the newer parhelion that wrote it"};
}

SqlValue instant(const std::optional<SimulationTime>& stamp) {
  return stamp ? SqlValue(stamp->ns) : SqlValue();
}
std::optional<SimulationTime> instant(const SqlRow& row, int column) {
  if (row.null(column)) return std::nullopt;
  return SimulationTime{row.integer(column)};
}

/// Returns the event's id, or NULL.
Result<SqlValue> insert_event(Database& database, std::int64_t session, const std::optional<Event>& event) {
  if (!event) return SqlValue();
  const Status inserted = database.run(
      "INSERT INTO events(session, at_ns, kind, subject, object, pair, x, y, z, impulse, value, "
      "undetectable, "
      "request, text) VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
      {session, event->stamp.ns, to_string(event->kind), event->subject, event->object,
       static_cast<std::int64_t>(event->pair), event->position.x(), event->position.y(), event->position.z(),
       event->impulse, event->value, std::int64_t{event->undetectable},
       static_cast<std::int64_t>(event->request), event->text});
  if (!inserted) return inserted.error();
  return SqlValue(database.inserted_id());
}

Result<Event> event_of(const SqlRow& row) {
  const auto kind = known(row.text(1), kLastEventKind);
  if (!kind) return kind.error();
  Event event;
  event.stamp = {row.integer(0)};
  event.kind = *kind;
  event.subject = row.text(2);
  event.object = row.text(3);
  event.pair = static_cast<PairKind>(row.integer(4));
  event.position = {row.real(5), row.real(6), row.real(7)};
  event.impulse = row.real(8);
  event.value = row.real(9);
  event.undetectable = row.integer(10) != 0;
  event.request = static_cast<std::uint64_t>(row.integer(11));
  event.text = row.text(12);
  return event;
}

Status read_event(Database& database, const SqlRow& row, int column, std::optional<Event>& event) {
  if (row.null(column)) return {};
  return database.each(
      "SELECT at_ns, kind, subject, object, pair, x, y, z, impulse, value, undetectable, request, text FROM "
      "events "
      "WHERE id = ?",
      {row.integer(column)}, [&](const SqlRow& found) -> Status {
        auto read = event_of(found);
        if (!read) return Error{database.path() + ": " + read.error().message};
        event = std::move(*read);
        return {};
      });
}

Status insert_tasks(Database& database, std::int64_t session, const std::vector<TaskGrade>& tasks) {
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const TaskGrade& task = tasks[i];
    const auto cause = insert_event(database, session, task.cause);
    if (!cause) return cause.error();
    const Status inserted = database.run(
        "INSERT INTO tasks(session, position, name, required, outcome, points, began_ns, ended_ns, cause) "
        "VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?)",
        {session, static_cast<std::int64_t>(i), task.name, std::int64_t{task.required},
         to_string(task.outcome), task.points, instant(task.began), instant(task.ended), *cause});
    if (!inserted) return inserted;
  }
  return {};
}

Status insert_deductions(Database& database, std::int64_t session, const std::vector<Deduction>& deductions) {
  for (std::size_t i = 0; i < deductions.size(); ++i) {
    const auto cause = insert_event(database, session, deductions[i].cause);
    if (!cause) return cause.error();
    const Status inserted = database.run(
        "INSERT INTO deductions(session, position, at_ns, rule, points, cause) VALUES(?, ?, ?, ?, ?, ?)",
        {session, static_cast<std::int64_t>(i), deductions[i].at.ns, deductions[i].rule, deductions[i].points,
         *cause});
    if (!inserted) return inserted;
  }
  return {};
}

Status read_tasks(Database& database, std::int64_t session, std::vector<TaskGrade>& tasks) {
  return database.each(
      "SELECT name, required, outcome, points, began_ns, ended_ns, cause FROM tasks WHERE session = ? "
      "ORDER BY position",
      {session}, [&](const SqlRow& row) -> Status {
        const auto outcome = known(row.text(2), TaskOutcome::out_of_time);
        if (!outcome) return Error{database.path() + ": " + outcome.error().message};
        TaskGrade& task = tasks.emplace_back();
        task.name = row.text(0);
        task.required = row.integer(1) != 0;
        task.outcome = *outcome;
        task.points = row.real(3);
        task.began = instant(row, 4);
        task.ended = instant(row, 5);
        return read_event(database, row, 6, task.cause);
      });
}

Status read_deductions(Database& database, std::int64_t session, std::vector<Deduction>& deductions) {
  return database.each(
      "SELECT at_ns, rule, points, cause FROM deductions WHERE session = ? ORDER BY position", {session},
      [&](const SqlRow& row) {
        Deduction& deduction = deductions.emplace_back();
        deduction.at = {row.integer(0)};
        deduction.rule = row.text(1);
        deduction.points = row.real(2);
        return read_event(database, row, 3, deduction.cause);
      });
}

}  // namespace

Status insert_grade(Database& database, std::int64_t session, const Grade& grade) {
  const Status inserted = database.run(
      "INSERT INTO scores(session, score, awarded, deducted, max, fraction, grade, passed, ended, complete) "
      "VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
      {session, grade.score, grade.awarded, grade.deducted, grade.max, grade.fraction, grade.grade,
       std::int64_t{grade.passed}, std::int64_t{grade.ended}, std::int64_t{grade.complete}});
  if (!inserted) return inserted;
  if (const Status tasks = insert_tasks(database, session, grade.tasks); !tasks) return tasks;
  return insert_deductions(database, session, grade.deductions);
}

Result<Grade> read_grade(Database& database, std::int64_t session) {
  Grade grade;
  const Status read = database.each(
      "SELECT begin_ns, end_ns, score, awarded, deducted, max, fraction, grade, passed, ended, complete "
      "FROM scores JOIN sessions ON sessions.id = scores.session WHERE session = ?",
      {session}, [&](const SqlRow& row) {
        grade.begin = {row.integer(0)};
        grade.end = {row.integer(1)};
        grade.score = row.real(2);
        grade.awarded = row.real(3);
        grade.deducted = row.real(4);
        grade.max = row.real(5);
        grade.fraction = row.real(6);
        grade.grade = row.text(7);
        grade.passed = row.integer(8) != 0;
        grade.ended = row.integer(9) != 0;
        grade.complete = row.integer(10) != 0;
        return Status();
      });
  if (!read) return read.error();
  if (const Status tasks = read_tasks(database, session, grade.tasks); !tasks) return tasks.error();
  if (const Status deductions = read_deductions(database, session, grade.deductions); !deductions)
    return deductions.error();
  return grade;
}

}  // namespace parhelion::training
