// Statements of the Experience API (ADL, xAPI 1.0.3, part 2): one per session, then one for each of its
// started tasks.
#define JSON_DIAGNOSTICS 1  // errors give the position in the document
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>

#include "protocols/enumerators.hpp"
#include "protocols/sha256.hpp"
#include "server/training/exchange.hpp"
#include "server/training/iso8601.hpp"
#include "server/training/json_reason.hpp"

namespace parhelion::training {
namespace {

using Json = nlohmann::ordered_json;

// Identifiers, not addresses: `.invalid` belongs to nobody (RFC 2606).
const std::string kActivity = "https://parhelion.invalid/scenario/";
const std::string kExtension = "https://parhelion.invalid/xapi/";
const std::string kVerb = "http://adlnet.gov/expapi/verbs/";

std::string sha256_of(const std::string& text) {
  Sha256 hash;
  hash.add({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  return hash.hex();
}

/// The same session always gets the same id: a UUID in the format of version 5 (RFC 9562), the newest
/// name-based version known to validators of xAPI 1.0.3.
std::string uuid_of(const std::string& identity) {
  std::string hex = sha256_of("parhelion session " + identity).substr(0, 32);
  hex[12] = '5';
  hex[16] = "89ab"[std::stoi(hex.substr(16, 1), nullptr, 16) & 3];
  for (const std::size_t at : {20, 16, 12, 8}) hex.insert(at, "-");
  return hex;
}

std::string percent_encoded(const std::string& text) {
  std::string encoded;
  for (const char letter : text) {
    const bool plain = (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z') ||
                       (letter >= '0' && letter <= '9') || std::strchr("-._~", letter) != nullptr;
    char code[4] = {letter, 0};
    if (!plain) std::snprintf(code, sizeof code, "%%%02X", static_cast<unsigned char>(letter));
    encoded += code;
  }
  return encoded;
}

Json actor_json(const TraineeRecord& trainee, const std::string& home_page) {
  if (!trainee.mbox_sha1sum.empty()) return {{"objectType", "Agent"}, {"mbox_sha1sum", trainee.mbox_sha1sum}};
  return {{"objectType", "Agent"}, {"account", {{"homePage", home_page}, {"name", trainee.pseudonym}}}};
}

/// A task is part of its session's scenario; statements of a session share a registration.
Json task_json(const TraineeRecord& trainee, const SessionRecord& session, std::size_t place,
               const std::string& home_page) {
  const TaskGrade& task = session.grade.tasks[place];
  const bool done = task.outcome == TaskOutcome::done, over = done || task.outcome != TaskOutcome::open;
  const std::string verb = done ? "completed" : over ? "failed" : "attempted";
  const std::string scenario = kActivity + percent_encoded(session.scenario);
  const SimulationTime end = task.ended.value_or(session.grade.end);
  Json extensions{{kExtension + "identity", session.identity},
                  {kExtension + "task", place},
                  {kExtension + "outcome", to_string(task.outcome)},
                  {kExtension + "required", task.required}};
  if (place < session.skills.size()) extensions[kExtension + "skills"] = session.skills[place];
  return {
      {"id", uuid_of(session.identity + " task " + std::to_string(place))},
      {"actor", actor_json(trainee, home_page)},
      {"verb", {{"id", kVerb + verb}, {"display", {{"en", verb}}}}},
      {"object",
       {{"objectType", "Activity"},
        {"id", scenario + "/task/" + percent_encoded(task.name)},
        {"definition",
         {{"name", {{"en", task.name}}}, {"type", "http://adlnet.gov/expapi/activities/objective"}}}}},
      {"result",
       {{"success", done},
        {"completion", over},
        {"score", {{"raw", task.points}}},
        {"duration", duration_text(end - *task.began)}}},
      {"context",
       {{"registration", uuid_of(session.identity)},
        {"platform", "Parhelion"},
        {"contextActivities", {{"parent", Json::array({{{"objectType", "Activity"}, {"id", scenario}}})}}},
        {"extensions", extensions}}},
      {"timestamp", timestamp_text(end)}};
}

Json statement_json(const TraineeRecord& trainee, const SessionRecord& session,
                    const std::string& home_page) {
  const Grade& grade = session.grade;
  const std::string verb = !grade.complete ? "attempted" : grade.passed ? "passed" : "failed";
  Json result{{"success", grade.passed},
              {"completion", grade.complete},
              {"duration", duration_text(grade.end - grade.begin)}};
  // A score must lie between min and max; without points there is no such range.
  const bool fits = grade.max > 0 && grade.score >= 0 && grade.score <= grade.max && grade.fraction >= 0 &&
                    grade.fraction <= 1;
  if (fits)
    result["score"] = {{"scaled", grade.fraction}, {"raw", grade.score}, {"min", 0.0}, {"max", grade.max}};
  return {{"id", uuid_of(session.identity)},
          {"actor", actor_json(trainee, home_page)},
          {"verb", {{"id", kVerb + verb}, {"display", {{"en", verb}}}}},
          {"object",
           {{"objectType", "Activity"},
            {"id", kActivity + percent_encoded(session.scenario)},
            {"definition",
             {{"name", {{"en", session.scenario}}},
              {"type", "http://adlnet.gov/expapi/activities/simulation"}}}}},
          {"result", result},
          {"context",
           {{"registration", uuid_of(session.identity)},
            {"platform", "Parhelion"},
            {"extensions",
             {{kExtension + "identity", session.identity},
              {kExtension + "programme", session.programme},
              {kExtension + "level", session.level},
              {kExtension + "robot", session.robot},
              {kExtension + "log", session.log},
              {kExtension + "grade", grade.grade},
              {kExtension + "awarded", grade.awarded},
              {kExtension + "deducted", grade.deducted}}}}},
          {"timestamp", timestamp_text(grade.end)}};
}

[[noreturn]] void refuse(const Json& where, const std::string& what) {
  throw nlohmann::detail::type_error::create(302, what, &where);
}

TraineeRecord trainee_of(const Json& actor) {
  if (actor.contains("mbox_sha1sum")) return {"", "", actor.at("mbox_sha1sum").get<std::string>()};
  if (!actor.contains("account")) refuse(actor, "expected an actor with an account or mbox_sha1sum");
  const std::string name = actor.at("account").at("name").get<std::string>();
  // An account of another system may be a person's name.
  return is_pseudonym(name) ? TraineeRecord{name, "", ""} : TraineeRecord{"", name, ""};
}

void read_score(const Json& score, Grade& grade) {
  const double low = score.value("min", 0.0);
  if (score.contains("raw")) {
    const double raw = score.at("raw").get<double>();
    if ((score.contains("min") && raw < low) || raw > score.value("max", raw))
      refuse(score, "expected raw from min to max");
    grade.score = grade.awarded = std::max(0.0, raw - low);
    grade.max = score.contains("max") ? score.at("max").get<double>() - low : 0;
    if (grade.max > 0) grade.fraction = grade.score / grade.max;
    if (!(grade.max >= 0)) refuse(score, "expected min below max");
  }
  if (score.contains("scaled")) {
    const double scaled = score.at("scaled").get<double>();
    if (!(scaled >= -1 && scaled <= 1)) refuse(score.at("scaled"), "expected -1 to 1");
    grade.fraction = std::max(0.0, scaled);
    if (!score.contains("raw")) {
      grade.score = grade.awarded = grade.fraction;
      grade.max = 1;
    }
  }
}

void read_when(const Json& statement, Grade& grade) {
  const Json& timestamp = statement.at("timestamp");
  const auto end = timestamp_of(timestamp.get<std::string>());
  if (!end) refuse(timestamp, "expected an instant as 2026-03-01T12:00:00Z, 1970 to 2200");
  grade.begin = grade.end = *end;
  const Json& result = statement.at("result");
  if (!result.contains("duration")) return;
  const auto duration = duration_of(result.at("duration").get<std::string>());
  if (!duration) refuse(result.at("duration"), "expected a duration as PT10M0.5S");
  grade.begin = grade.end - *duration;
}

void read_extensions(const Json& statement, SessionRecord& session) {
  if (!statement.contains("context") || !statement.at("context").contains("extensions")) return;
  const Json& extensions = statement.at("context").at("extensions");
  session.identity = extensions.value(kExtension + "identity", session.identity);
  session.programme = extensions.value(kExtension + "programme", "");
  session.level = extensions.value(kExtension + "level", 0);
  session.robot = extensions.value(kExtension + "robot", "");
  session.log = extensions.value(kExtension + "log", "");
  session.grade.grade = extensions.value(kExtension + "grade", "");
  session.grade.awarded = extensions.value(kExtension + "awarded", session.grade.awarded);
  session.grade.deducted = extensions.value(kExtension + "deducted", 0.0);
}

SessionRecord session_of(const Json& statement) {
  SessionRecord session;
  session.identity = "xapi:" + (statement.contains("id") ? statement.at("id").get<std::string>()
                                                         : sha256_of(statement.dump()));
  const Json& object = statement.at("object");
  session.scenario = object.at("id").get<std::string>();
  if (object.contains("definition") && object.at("definition").contains("name") &&
      !object.at("definition").at("name").empty())
    session.scenario = object.at("definition").at("name").begin()->get<std::string>();
  const Json& result = statement.at("result");
  Grade& grade = session.grade;
  if (result.contains("score")) read_score(result.at("score"), grade);
  grade.passed = result.value("success", statement.at("verb").at("id") == kVerb + "passed");
  grade.complete = grade.ended = result.value("completion", true);
  read_when(statement, grade);
  read_extensions(statement, session);
  return session;
}

const Json* extension_of(const Json& statement, const std::string& name) {
  if (!statement.contains("context") || !statement.at("context").contains("extensions")) return nullptr;
  const Json& extensions = statement.at("context").at("extensions");
  return extensions.contains(kExtension + name) ? &extensions.at(kExtension + name) : nullptr;
}

/// Adds one of our own tasks to its session, whose statement came before. Statements do not contain the
/// cause.
bool add_task(const Json& statement, std::vector<SessionRecord>& sessions) {
  const Json* identity = extension_of(statement, "identity");
  const auto session = std::find_if(sessions.begin(), sessions.end(), [&](const SessionRecord& each) {
    return identity && *identity == each.identity;
  });
  if (session == sessions.end()) return false;
  const Json* outcome = extension_of(statement, "outcome");
  const Json* required = extension_of(statement, "required");
  const Json& result = statement.at("result");
  Grade when;
  read_when(statement, when);
  TaskGrade task;
  const Json& names = statement.at("object").at("definition").at("name");  // by language
  if (names.empty()) refuse(statement.at("object").at("definition"), "expected the name of a task");
  task.name = names.begin()->get<std::string>();
  task.required = required && required->get<bool>();
  const auto known = enumerator(outcome ? outcome->get<std::string>() : "", TaskOutcome::out_of_time);
  if (!known) refuse(statement.at("context").at("extensions"), "expected the outcome of a task");
  task.outcome = *known;
  task.points = result.at("score").at("raw").get<double>();
  task.began = when.begin;
  if (task.outcome != TaskOutcome::open) task.ended = when.end;
  session->grade.tasks.push_back(std::move(task));
  if (const Json* skills = extension_of(statement, "skills"))
    session->skills.push_back(skills->get<std::vector<std::string>>());
  return true;
}

/// Whether the statement has a result; "launched" and the like do not.
bool is_graded(const Json& statement) {
  return statement.contains("result") &&
         (statement.at("result").contains("score") || statement.at("result").contains("success"));
}

}  // namespace

std::string to_xapi(const std::vector<TraineeHistory>& trainees, const std::string& home_page) {
  Json statements = Json::array();
  for (const TraineeHistory& history : trainees)
    for (const SessionRecord& session : history.sessions) {
      statements.push_back(statement_json(history.trainee, session, home_page));
      for (std::size_t i = 0; i < session.grade.tasks.size(); ++i)
        if (session.grade.tasks[i].began)
          statements.push_back(task_json(history.trainee, session, i, home_page));
    }
  return statements.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<Histories> histories_from_xapi(const std::string& text, const std::string& origin) {
  if (nested_deeper(text, kMaxJsonLevels)) return Error{origin + kTooDeep};
  Histories histories;
  std::map<std::string, std::size_t> places;
  const auto take = [&](const Json& statement) {
    if (!is_graded(statement)) {
      ++histories.skipped;
      return;
    }
    TraineeRecord trainee = trainee_of(statement.at("actor"));
    const std::string who = trainee.pseudonym + '\n' + trainee.name + '\n' + trainee.mbox_sha1sum;
    const auto [place, is_new] = places.try_emplace(who, histories.trainees.size());
    if (extension_of(statement, "task")) {
      const bool taken = !is_new && add_task(statement, histories.trainees[place->second].sessions);
      histories.skipped += taken ? 0 : 1;
      if (is_new) places.erase(place);
      return;
    }
    if (is_new) histories.trainees.push_back({std::move(trainee), {}});
    histories.trainees[place->second].sessions.push_back(session_of(statement));
  };
  try {
    const Json json = Json::parse(text);
    const Json& statements = json.is_object() && json.contains("statements") ? json.at("statements") : json;
    if (statements.is_array()) {
      for (const Json& statement : statements) take(statement);
    } else {
      take(statements);
    }
  } catch (const Json::exception& error) {
    return Error{origin + ": " + json_reason(error)};
  }
  return histories;
}

}  // namespace parhelion::training
