#include "server/training/grading_text.hpp"

#include <cstdio>

namespace parhelion::training {

const char* to_string(TaskOutcome outcome) {
  switch (outcome) {
    case TaskOutcome::waiting:
      return "waiting";
    case TaskOutcome::open:
      return "open";
    case TaskOutcome::done:
      return "done";
    case TaskOutcome::failed:
      return "failed";
    case TaskOutcome::out_of_time:
      return "out_of_time";
  }
  return "";
}

std::string event_text(const std::optional<Event>& event) {
  if (!event) return "";
  std::string text = std::string(to_string(event->kind)) + " " + event->subject;
  if (!event->object.empty()) text += " - " + event->object;
  if (event->kind == EventKind::near_miss) {
    char nearest[48];
    std::snprintf(nearest, sizeof nearest, event->text == "time" ? " (%.2f s to a collision)" : " (%.2f m)",
                  event->value);
    return text + nearest;
  }
  if (!event->text.empty()) text += " (" + event->text + ")";
  char impulse[32];
  std::snprintf(impulse, sizeof impulse, ", %.2f N s", event->impulse);
  return event->impulse > 0 ? text + impulse : text;
}

std::string points_text(double points) {
  char text[48];
  std::snprintf(text, sizeof text, "%+g points", points);
  return text;
}

std::string verdict_text(const Grade& grade) {
  char text[96];
  std::snprintf(text, sizeof text, "%g of %g points (%.1f %%)", grade.score, grade.max, 100 * grade.fraction);
  return text + (grade.grade.empty() ? std::string() : ", grade " + grade.grade) +
         (grade.passed ? ", passed" : ", not passed");
}

}  // namespace parhelion::training
