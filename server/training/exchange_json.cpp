// The complete records as one JSON document.
#define JSON_DIAGNOSTICS 1  // errors give the position in the document
#include <nlohmann/json.hpp>

#include "protocols/enumerators.hpp"
#include "server/training/exchange.hpp"
#include "server/training/grade_json.hpp"
#include "server/training/json_reason.hpp"

namespace parhelion::training {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "parhelion records";
constexpr int kVersion = 1;

Json session_json(const SessionRecord& session) {
  Json json{{"identity", session.identity},
            {"scenario", session.scenario},
            {"programme", session.programme},
            {"level", session.level},
            {"robot", session.robot},
            {"log", session.log},
            {"skipped_bytes", session.skipped_bytes}};
  put_grade(session.grade, json);
  for (std::size_t i = 0; i < session.grade.tasks.size(); ++i)
    json["tasks"][i]["skills"] = i < session.skills.size() ? Json(session.skills[i]) : Json::array();
  return json;
}

// Reading throws nlohmann's exceptions with their position; histories_from_json converts them to Errors.

std::int64_t integer(const Json& json, const char* key) {
  const Json& value = json.at(key);
  if (!value.is_number_integer())
    throw nlohmann::detail::type_error::create(302, "expected a whole number", &value);
  return value.get<std::int64_t>();
}

std::optional<SimulationTime> instant(const Json& json, const char* key) {
  if (json.at(key).is_null()) return std::nullopt;
  return SimulationTime{integer(json, key)};
}

template <class Enum>
Enum named(const Json& json, const char* key, Enum last) {
  const std::string name = json.at(key).get<std::string>();
  if (const auto found = enumerator(name, last)) return *found;
  throw nlohmann::detail::type_error::create(302, "'" + name + "' is not known here", &json.at(key));
}

std::optional<Event> event_of(const Json& json) {
  if (json.is_null()) return std::nullopt;
  Event event;
  event.kind = named(json, "kind", kLastEventKind);
  event.subject = json.at("subject").get<std::string>();
  event.object = json.at("object").get<std::string>();
  event.stamp = {integer(json, "time_ns")};
  const std::int64_t pair = integer(json, "pair");
  if (pair < 0 || pair > static_cast<int>(PairKind::virtual_virtual))
    throw nlohmann::detail::type_error::create(302, "expected 0 to 3", &json.at("pair"));
  event.pair = static_cast<PairKind>(pair);
  for (int i = 0; i < 3; ++i) event.position[i] = json.at("position").at(i).get<double>();
  event.impulse = json.at("impulse").get<double>();
  event.value = json.at("value").get<double>();
  event.undetectable = json.at("undetectable").get<bool>();
  event.request = json.at("request").get<std::uint64_t>();
  event.text = json.at("text").get<std::string>();
  return event;
}

TaskGrade task_of(const Json& json) {
  TaskGrade task;
  task.name = json.at("name").get<std::string>();
  task.required = json.at("required").get<bool>();
  task.outcome = named(json, "outcome", TaskOutcome::out_of_time);
  task.points = json.at("points").get<double>();
  task.began = instant(json, "began_ns");
  task.ended = instant(json, "ended_ns");
  task.cause = event_of(json.at("cause"));
  return task;
}

SessionRecord session_of(const Json& json) {
  SessionRecord session;
  session.identity = json.at("identity").get<std::string>();
  session.scenario = json.at("scenario").get<std::string>();
  session.programme = json.at("programme").get<std::string>();
  session.level = static_cast<int>(integer(json, "level"));
  session.robot = json.at("robot").get<std::string>();
  session.log = json.at("log").get<std::string>();
  session.skipped_bytes = json.at("skipped_bytes").get<std::uint64_t>();
  Grade& grade = session.grade;
  grade.score = json.at("score").get<double>();
  grade.awarded = json.at("awarded").get<double>();
  grade.deducted = json.at("deducted").get<double>();
  grade.max = json.at("max").get<double>();
  grade.fraction = json.at("fraction").get<double>();
  grade.grade = json.at("grade").get<std::string>();
  grade.passed = json.at("passed").get<bool>();
  grade.ended = json.at("ended").get<bool>();
  grade.complete = json.at("complete").get<bool>();
  grade.begin = {integer(json, "begin_ns")};
  grade.end = {integer(json, "end_ns")};
  for (const Json& task : json.at("tasks")) {
    grade.tasks.push_back(task_of(task));
    session.skills.push_back(task.at("skills").get<std::vector<std::string>>());
  }
  for (const Json& deduction : json.at("deductions"))
    grade.deductions.push_back({SimulationTime{integer(deduction, "at_ns")},
                                deduction.at("rule").get<std::string>(), deduction.at("points").get<double>(),
                                event_of(deduction.at("cause"))});
  return session;
}

}  // namespace

std::string to_json(const std::vector<TraineeHistory>& trainees) {
  Json json{{"format", kFormat}, {"version", kVersion}};
  Json& list = json["trainees"] = Json::array();
  for (const TraineeHistory& history : trainees) {
    Json one{{"pseudonym", history.trainee.pseudonym}};
    if (!history.trainee.name.empty()) one["name"] = history.trainee.name;
    if (!history.trainee.mbox_sha1sum.empty()) one["mbox_sha1sum"] = history.trainee.mbox_sha1sum;
    Json& sessions = one["sessions"] = Json::array();
    for (const SessionRecord& session : history.sessions) sessions.push_back(session_json(session));
    list.push_back(std::move(one));
  }
  // Invalid UTF-8 in a name must not abort an export.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<Histories> histories_from_json(const std::string& text, const std::string& origin) {
  if (nested_deeper(text, kMaxJsonLevels)) return Error{origin + kTooDeep};
  Histories histories;
  try {
    const Json json = Json::parse(text);
    if (json.at("format") != kFormat || integer(json, "version") != kVersion)
      return Error{origin + ": expected \"format\": \"" + kFormat + "\", \"version\": " +
                   std::to_string(kVersion) + "; a file of a newer version needs that version"};
    for (const Json& one : json.at("trainees")) {
      TraineeHistory& history = histories.trainees.emplace_back();
      history.trainee.pseudonym = one.at("pseudonym").get<std::string>();
      history.trainee.name = one.value("name", "");
      history.trainee.mbox_sha1sum = one.value("mbox_sha1sum", "");
      for (const Json& session : one.at("sessions")) history.sessions.push_back(session_of(session));
    }
  } catch (const Json::exception& error) {
    return Error{origin + ": " + json_reason(error)};
  }
  return histories;
}

}  // namespace parhelion::training
