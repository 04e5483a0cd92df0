// Everything, as one JSON document.
#define JSON_DIAGNOSTICS 1  // errors say where in the document
#include <cstring>
#include <nlohmann/json.hpp>

#include "server/training/exchange.hpp"

namespace parhelion {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "parhelion records";
constexpr int kVersion = 1;

Json instant_json(const std::optional<SimulationTime>& stamp) { return stamp ? Json(stamp->ns) : Json(); }

Json event_json(const std::optional<Event>& event) {
  if (!event) return nullptr;
  return {{"kind", to_string(event->kind)},
          {"subject", event->subject},
          {"object", event->object},
          {"time_ns", event->stamp.ns},
          {"pair", static_cast<int>(event->pair)},
          {"position", {event->position.x(), event->position.y(), event->position.z()}},
          {"impulse", event->impulse},
          {"value", event->value},
          {"unsensed", event->unsensed},
          {"request", event->request},
          {"text", event->text}};
}

Json session_json(const SessionRecord& session) {
  const Grade& grade = session.grade;
  Json json{{"identity", session.identity},   {"scenario", session.scenario},
            {"programme", session.programme}, {"level", session.level},
            {"robot", session.robot},         {"log", session.log},
            {"score", grade.score},           {"earned", grade.earned},
            {"charged", grade.charged},       {"most", grade.most},
            {"share", grade.share},           {"grade", grade.grade},
            {"passed", grade.passed},         {"ended", grade.ended},
            {"complete", grade.complete},     {"begin_ns", grade.begin.ns},
            {"end_ns", grade.end.ns},         {"damaged_bytes", session.damaged_bytes}};
  Json& tasks = json["tasks"] = Json::array();
  for (std::size_t i = 0; i < grade.tasks.size(); ++i) {
    const TaskGrade& task = grade.tasks[i];
    tasks.push_back({{"name", task.name},
                     {"skills", i < session.skills.size() ? Json(session.skills[i]) : Json::array()},
                     {"required", task.required},
                     {"outcome", to_string(task.outcome)},
                     {"points", task.points},
                     {"began_ns", instant_json(task.began)},
                     {"ended_ns", instant_json(task.ended)},
                     {"cause", event_json(task.cause)}});
  }
  Json& charges = json["charges"] = Json::array();
  for (const Charge& charge : grade.charges)
    charges.push_back({{"rule", charge.rule},
                       {"points", charge.points},
                       {"at_ns", charge.at.ns},
                       {"cause", event_json(charge.cause)}});
  return json;
}

// Reading throws nlohmann's exceptions, which say where; histories_from_json makes Errors of them.

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
  for (int i = 0; i <= static_cast<int>(last); ++i)
    if (name == to_string(static_cast<Enum>(i))) return static_cast<Enum>(i);
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
  event.unsensed = json.at("unsensed").get<bool>();
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
  session.damaged_bytes = json.at("damaged_bytes").get<std::uint64_t>();
  Grade& grade = session.grade;
  grade.score = json.at("score").get<double>();
  grade.earned = json.at("earned").get<double>();
  grade.charged = json.at("charged").get<double>();
  grade.most = json.at("most").get<double>();
  grade.share = json.at("share").get<double>();
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
  for (const Json& charge : json.at("charges"))
    grade.charges.push_back({SimulationTime{integer(charge, "at_ns")}, charge.at("rule").get<std::string>(),
                             charge.at("points").get<double>(), event_of(charge.at("cause"))});
  return session;
}

/// nlohmann's message without its own number in front.
std::string reason(const std::exception& error) {
  const char* text = std::strstr(error.what(), "] ");
  return text == nullptr ? error.what() : text + 2;
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
  // What is no UTF-8 in a name of the world must not end an export.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<Histories> histories_from_json(const std::string& text, const std::string& origin) {
  Histories histories;
  try {
    const Json json = Json::parse(text);
    if (json.at("format") != kFormat || integer(json, "version") != kVersion)
      return Error{origin + ": expected \"format\": \"" + kFormat + "\", \"version\": " +
                   std::to_string(kVersion) + "; if it is of a newer parhelion, use that"};
    for (const Json& one : json.at("trainees")) {
      TraineeHistory& history = histories.trainees.emplace_back();
      history.trainee.pseudonym = one.at("pseudonym").get<std::string>();
      history.trainee.name = one.value("name", "");
      history.trainee.mbox_sha1sum = one.value("mbox_sha1sum", "");
      for (const Json& session : one.at("sessions")) history.sessions.push_back(session_of(session));
    }
  } catch (const Json::exception& error) {
    return Error{origin + ": " + reason(error)};
  }
  return histories;
}

}  // namespace parhelion
