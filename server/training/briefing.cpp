#include "server/training/briefing.hpp"

#include <cstdio>
#include <numbers>

#include "server/training/event_phrase.hpp"

namespace parhelion::training {
namespace {

using Kind = Condition::Kind;

std::string number(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string points_text(double points) { return number("%g", points) + (points == 1 ? " point" : " points"); }

std::string time_text(double seconds) {
  return seconds >= 120 ? number("%g min", seconds / 60) : number("%g s", seconds);
}

std::string angle_text(double rad) { return number("%.3g deg", rad * 180 / std::numbers::pi); }

std::string distance_text(const Condition& condition) {
  return condition.distance > 0 ? number(" within %g m", condition.distance) : "";
}

std::string duration_text(const Condition& condition) {
  return condition.duration > 0 ? " for " + time_text(condition.duration) : "";
}

/// Text of a near miss by distance or by time (server/simulation/bodies/near_miss.hpp).
std::string near_miss_text(const Condition& condition) {
  const std::string whom = condition.object.empty() ? "anything" : condition.object;
  const bool by_gap = condition.text == "gap", by_time = condition.text == "time";
  std::string gap = "passing too near to " + whom, time = "almost driving into " + whom;
  if (by_gap && condition.max) gap = "passing " + whom + number(" nearer than %g m", *condition.max);
  if (by_time && condition.max) time += number(", less than %g s from it", *condition.max);
  if (by_gap || by_time) return by_gap ? gap : time;
  return gap + " or " + time;
}

std::string condition_event_text(const Condition& condition) {
  const bool by_whom = !condition.subject.empty() || condition.min || condition.count > 1;
  if (condition.event == EventKind::near_miss && !by_whom) return near_miss_text(condition);
  std::string text = event_phrase(condition.event, condition.object);
  if (!condition.text.empty()) text += " (" + condition.text + ")";
  if (condition.impulse > 0) text += number(" with %g N s or more", condition.impulse);
  if (!condition.subject.empty())
    text += ", by " + (condition.subject == "any" ? std::string("anybody") : condition.subject);
  if (condition.min) text += number(", value at least %g", *condition.min);
  if (condition.max) text += number(", value at most %g", *condition.max);
  if (condition.count > 1) text += ", " + std::to_string(condition.count) + " times";
  return text;
}

/// "reach the yard", a task; "reaching the yard", what points are deducted for.
enum class Form { task, cause };

std::string text_in(Form form, const Condition& condition);

std::string parts_text(Form form, const Condition& condition, const char* between) {
  std::string text;
  for (const Condition& part : condition.parts) text += (text.empty() ? "" : between) + text_in(form, part);
  return condition.parts.size() > 1 ? "(" + text + ")" : text;
}

std::string own_text(Form form, const Condition& condition) {
  const auto verb = [form](const char* task, const char* cause) {
    return std::string(form == Form::task ? task : cause);
  };
  switch (condition.kind) {
    case Kind::event:
      return condition_event_text(condition);
    case Kind::reach:
      return verb("reach ", "reaching ") + condition.target;
    case Kind::pass:
      return verb("pass through ", "passing through ") + condition.target;
    case Kind::climb:
      return verb("climb ", "climbing ") + condition.target;
    case Kind::near:
      return (condition.duration > 0 ? verb("stay", "staying") : verb("come", "coming")) +
             distance_text(condition) + " of " + condition.target + duration_text(condition);
    case Kind::still:
      return verb("stand still", "standing still") + duration_text(condition);
    case Kind::inspect:
      return verb("keep ", "keeping ") + condition.target + " in the camera's view" +
             distance_text(condition) + duration_text(condition);
    case Kind::follow:
      return verb("follow ", "following ") + condition.target + distance_text(condition) +
             duration_text(condition);
    case Kind::avoid:
      return (condition.distance > 0
                  ? verb("stay ", "staying ") + number("%g m away from ", condition.distance)
                  : verb("do not touch ", "not touching ")) +
             condition.target + duration_text(condition);
    case Kind::report:
      return verb("find and report ", "finding and reporting ") + condition.target +
             (condition.distance > 0 ? number(", its place to %g m", condition.distance) : "");
    case Kind::grip:
      return verb("grip ", "gripping ") + condition.target;
    case Kind::lift:
      return verb("lift ", "lifting ") + condition.target;
    case Kind::place:
      return verb("place ", "placing ") + condition.target +
             (condition.into.empty() ? "" : " in " + condition.into);
    case Kind::pitch:
      return "pitch of " + angle_text(condition.amount) + " or more" + duration_text(condition);
    case Kind::roll:
      return "roll of " + angle_text(condition.amount) + " or more" + duration_text(condition);
    case Kind::yaw_rate:
      return "turn of " + angle_text(condition.amount) + "/s or more" + duration_text(condition);
    case Kind::speed:
      return number("speed of %g m/s or more", condition.amount) + duration_text(condition);
    case Kind::all:
      return parts_text(form, condition, " and ");
    case Kind::any:
      return parts_text(form, condition, " or ");
    case Kind::then:
      return parts_text(form, condition, ", then ");
  }
  return "";
}

std::string text_in(Form form, const Condition& condition) {
  std::string text = own_text(form, condition);
  if (condition.within) text += ", within " + time_text(*condition.within);
  for (const Condition& never : condition.never) text += ", without " + text_in(Form::cause, never);
  return text;
}

std::string task_text(const Task& task, std::size_t place) {
  std::string text = "  " + std::to_string(place) + ". " + task.name + ": " + points_text(task.points);
  if (task.required) text += ", required";
  if (task.limit) text += ", at most " + time_text(*task.limit);
  if (!task.text.empty()) text += "\n     " + task.text;
  text += "\n     done:   " + condition_text(task.done) + "\n";
  for (const Condition& failed : task.failed) text += "     failed: " + cause_text(failed) + "\n";
  return text;
}

std::string penalty_text(const Penalty& penalty) {
  std::string text = "  " + penalty.name + ":";
  if (penalty.points > 0) text += " " + points_text(penalty.points);
  if (penalty.points > 0 && penalty.per_impulse > 0) text += " and";
  if (penalty.per_impulse > 0) text += " " + points_text(penalty.per_impulse) + " for each N s";
  if (penalty.max) text += number(", at most %g in all", *penalty.max);
  return text + ", for " + cause_text(penalty.when) + "\n";
}

std::string scale_text(const Training& training) {
  double max = 0;
  for (const Task& task : training.tasks) max += task.points;
  std::string text = number("Points: %g for all tasks, less penalties", max);
  if (training.pass_mark > 0) text += number("; passed with %g %% or more", 100 * training.pass_mark);
  text += ".\n";
  for (const GradeStep& step : training.grades)
    text += "  grade " + step.name + number(" from %g %%\n", 100 * step.from);
  return text;
}

/// "r1 and r2, each graded separately".
std::string robots_text(const std::vector<std::string>& robots) {
  std::string text;
  for (std::size_t i = 0; i < robots.size(); ++i)
    text += (i == 0 ? "" : i + 1 < robots.size() ? ", " : " and ") + robots[i];
  return robots.size() > 1 ? text + ", each graded separately" : text;
}

}  // namespace

std::string condition_text(const Condition& condition) { return text_in(Form::task, condition); }

std::string cause_text(const Condition& condition) { return text_in(Form::cause, condition); }

std::string briefing(const Scenario& scenario, const std::vector<std::string>& robots) {
  if (!scenario.training) return "";
  const Training& training = *scenario.training;
  std::string text = (scenario.name.empty() ? "Training" : scenario.name) + " (level " +
                     std::to_string(scenario.level) + "), with " + robots_text(robots) + "\n";
  if (!training.text.empty()) text += training.text + "\n";
  if (training.limit) text += "Time: " + time_text(*training.limit) + " in total.\n";
  text += training.in_order ? "Tasks, one after the other:\n" : "Tasks, in any order:\n";
  for (std::size_t i = 0; i < training.tasks.size(); ++i) text += task_text(training.tasks[i], i + 1);
  text += scale_text(training);
  if (!training.penalties.empty()) text += "Penalties, each time:\n";
  for (const Penalty& penalty : training.penalties) text += penalty_text(penalty);
  for (const DrawnValue& drawn : scenario.drawn_values)
    text += "Drawn this time: " + drawn.key + " = " + drawn.value + "\n";
  return text;
}

}  // namespace parhelion::training
