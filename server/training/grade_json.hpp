// A grade as JSON, for `grade --json` and the export of records. `Json` is the includer's library type, so
// that this header does not depend on the library.
#pragma once

#include <optional>

#include "server/training/grader.hpp"

namespace parhelion::training {

template <class Json>
Json instant_json(const std::optional<SimulationTime>& stamp) {
  return stamp ? Json(stamp->ns) : Json();
}

template <class Json>
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
          {"undetectable", event->undetectable},
          {"request", event->request},
          {"text", event->text}};
}

/// Adds the contents of `grade` to the object `json`, each point with its event, rule and instant; numbers
/// convert back to the same bits.
template <class Json>
void put_grade(const Grade& grade, Json& json) {
  json["score"] = grade.score;
  json["awarded"] = grade.awarded;
  json["deducted"] = grade.deducted;
  json["max"] = grade.max;
  json["fraction"] = grade.fraction;
  json["grade"] = grade.grade;
  json["passed"] = grade.passed;
  json["ended"] = grade.ended;
  json["complete"] = grade.complete;
  json["begin_ns"] = grade.begin.ns;
  json["end_ns"] = grade.end.ns;
  Json& tasks = json["tasks"] = Json::array();
  for (const TaskGrade& task : grade.tasks)
    tasks.push_back({{"name", task.name},
                     {"required", task.required},
                     {"outcome", to_string(task.outcome)},
                     {"points", task.points},
                     {"began_ns", instant_json<Json>(task.began)},
                     {"ended_ns", instant_json<Json>(task.ended)},
                     {"cause", event_json<Json>(task.cause)}});
  Json& deductions = json["deductions"] = Json::array();
  for (const Deduction& deduction : grade.deductions)
    deductions.push_back({{"rule", deduction.rule},
                          {"points", deduction.points},
                          {"at_ns", deduction.at.ns},
                          {"cause", event_json<Json>(deduction.cause)}});
}

}  // namespace parhelion::training
