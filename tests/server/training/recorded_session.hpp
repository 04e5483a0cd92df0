// Sessions for the records, which use every field of a grade.
#pragma once

#include <iomanip>
#include <sstream>
#include <string>

#include "server/training/records.hpp"

namespace parhelion::test {

inline Event recorded_event(int number) {
  Event event;
  event.stamp = SimulationTime{1'700'000'000'123'456'789 + number};
  event.kind = static_cast<EventKind>(number % (static_cast<int>(kLastEventKind) + 1));
  event.subject = "rover";
  event.object = "Türe \"" + std::to_string(number) + "\", links;\nunten";
  event.pair = PairKind::real_virtual;
  event.position = {0.1 * number, -1.0 / 3, 1e-300};
  event.impulse = 4.2 + number;
  event.value = -0.1;
  event.undetectable = number % 3 == 0;
  event.request = 0xffffffffffffffffULL;
  event.text = "in wall 7";
  return event;
}

/// `number` determines its identity.
inline training::SessionRecord recorded_session(int number) {
  training::SessionRecord session;
  session.identity = std::to_string(number);
  session.scenario = "first lesson";
  session.programme = number % 2 == 0 ? "" : "doors";
  session.robot = "rover";
  session.log = "session-" + std::to_string(number) + ".lcm";
  session.level = 1 + number % 3;
  session.skipped_bytes = static_cast<std::uint64_t>(number) * 7;
  training::Grade& grade = session.grade;
  grade.begin = SimulationTime{1'700'000'000'000'000'001 + number * 1'000'000'000'000};
  grade.end = grade.begin + seconds(600.1);
  for (const training::TaskOutcome outcome :
       {training::TaskOutcome::done, training::TaskOutcome::failed, training::TaskOutcome::waiting}) {
    training::TaskGrade& task = grade.tasks.emplace_back();
    task.name = "task " + std::to_string(grade.tasks.size());
    task.required = grade.tasks.size() == 1;
    task.outcome = outcome;
    task.points = outcome == training::TaskOutcome::done ? 50.1 : 0;
    if (outcome == training::TaskOutcome::waiting) continue;
    task.began = grade.begin;
    task.ended = grade.begin + seconds(30);
    if (outcome == training::TaskOutcome::done) task.cause = recorded_event(number);
  }
  session.skills = {{"doors", "driving"}, {}, {"stairs"}};
  grade.deductions = {{grade.begin + seconds(1), "collision", 5 + 0.1 * number, recorded_event(number + 1)},
                      {grade.begin + seconds(2), "too near", 1.0 / 3, std::nullopt}};
  grade.awarded = 50.1;
  grade.deducted = 5 + 0.1 * number + 1.0 / 3;
  grade.max = 120;
  grade.score = grade.awarded - grade.deducted;
  grade.fraction = grade.score / grade.max;
  grade.grade = "C";
  grade.passed = number % 2 == 0;
  grade.ended = grade.complete = true;
  return session;
}

inline std::string text_of(const std::optional<Event>& event) {
  if (!event) return "-";
  std::ostringstream text;
  text << std::hexfloat << event->stamp.ns << ' ' << to_string(event->kind) << ' ' << event->subject << '|'
       << event->object << '|' << static_cast<int>(event->pair) << ' ' << event->position.x() << ' '
       << event->position.y() << ' ' << event->position.z() << ' ' << event->impulse << ' ' << event->value
       << ' ' << event->undetectable << ' ' << event->request << ' ' << event->text;
  return text.str();
}

/// All fields, numbers to the bit.
inline std::string text_of(const training::SessionRecord& session) {
  const auto at = [](const std::optional<SimulationTime>& t) { return t ? std::to_string(t->ns) : "-"; };
  const training::Grade& grade = session.grade;
  std::ostringstream text;
  text << std::hexfloat << session.identity << '|' << session.scenario << '|' << session.programme << '|'
       << session.robot << '|' << session.log << '|' << session.level << ' ' << session.skipped_bytes << ' '
       << grade.begin.ns << ' ' << grade.end.ns << ' ' << grade.awarded << ' ' << grade.deducted << ' '
       << grade.max << ' ' << grade.score << ' ' << grade.fraction << ' ' << grade.grade << ' '
       << grade.passed << grade.ended << grade.complete << '\n';
  for (const training::TaskGrade& task : grade.tasks)
    text << task.name << '|' << task.required << ' ' << to_string(task.outcome) << ' ' << task.points << ' '
         << at(task.began) << ' ' << at(task.ended) << ' ' << text_of(task.cause) << '\n';
  for (const auto& skills : session.skills) {
    for (const std::string& skill : skills) text << skill << ' ';
    text << '\n';
  }
  for (const training::Deduction& deduction : grade.deductions)
    text << deduction.at.ns << ' ' << deduction.rule << ' ' << deduction.points << ' '
         << text_of(deduction.cause) << '\n';
  return text.str();
}

}  // namespace parhelion::test
