#include "protocols/yaml/lessons.hpp"

#include <array>

#include "protocols/yaml/parts.hpp"

namespace parhelion {

const char* to_string(Lesson::Kind kind) {
  switch (kind) {
    case Lesson::Kind::camera_delay:
      return "camera_delay";
    case Lesson::Kind::camera_loss:
      return "camera_loss";
    case Lesson::Kind::laser_dropouts:
      return "laser_dropouts";
    case Lesson::Kind::low_battery:
      return "low_battery";
    case Lesson::Kind::dead_wheel:
      return "dead_wheel";
  }
  return "unknown";
}

namespace yaml {
namespace {

using Kind = Lesson::Kind;
constexpr std::array<Kind, 5> kinds{Kind::camera_delay, Kind::camera_loss, Kind::laser_dropouts,
                                    Kind::low_battery, Kind::dead_wheel};

Lesson read_lesson(const Node& node, int level, Problems& problems) {
  Lesson lesson;
  const Node* found = nullptr;
  std::string names;
  for (const Kind kind : kinds) {
    names += (names.empty() ? "" : ", ") + std::string(to_string(kind));
    const Node* here = node.find(to_string(kind));
    if (!here) continue;
    if (found) problems.add(here->line, "a fault: found two, expected one; list them separately");
    found = here;
    lesson.kind = kind;
  }
  if (!found) {
    problems.add(node.line, "a fault: expected one of " + names);
    return lesson;
  }
  if (lesson.kind == Kind::dead_wheel) {
    lesson.right = found->text == "right";
  } else {
    lesson.amount = found->number;
  }
  read(node, "after", lesson.after);
  if (node.find("for")) read(node, "for", lesson.lasting.emplace());
  if (lesson.kind == Kind::low_battery && (lesson.after > 0 || lesson.lasting))
    problems.add(found->line,
                 "'low_battery' sets the charge at the start: 'after' and 'for' are not allowed");
  if (level >= 3 && needs_simulated_robot(lesson.kind))
    problems.add(found->line, std::string("'") + to_string(lesson.kind) +
                                  "' is a fault of simulated robots: at level 3 the robot is real, and its "
                                  "sensors and drive are not changed; use level 1 or 2");
  return lesson;
}

}  // namespace

std::vector<Lesson> read_lessons(const Node& list, int level, Problems& problems) {
  std::vector<Lesson> lessons;
  for (const Node& node : list.items) lessons.push_back(read_lesson(node, level, problems));
  return lessons;
}

void write_lessons(Writer& writer, const std::vector<Lesson>& lessons) {
  if (lessons.empty()) return;
  writer.open("lessons");
  for (const Lesson& lesson : lessons) {
    writer.begin_item();
    const char* name = to_string(lesson.kind);
    if (lesson.kind == Kind::dead_wheel) {
      writer.word(name, lesson.right ? "right" : "left");
    } else if (lesson.kind == Kind::camera_delay) {
      writer.quantity(name, lesson.amount, Quantity::time);
    } else {
      writer.number(name, lesson.amount);
    }
    if (lesson.after > 0) writer.quantity("after", lesson.after, Quantity::time);
    if (lesson.lasting) writer.quantity("for", *lesson.lasting, Quantity::time);
    writer.end_item();
  }
  writer.close();
}

std::vector<DrawnValue> read_drawn(const Node& list) {
  std::vector<DrawnValue> drawn;
  for (const Node& node : list.items) {
    DrawnValue& each = drawn.emplace_back();
    read(node, "key", each.key);
    read(node, "from", each.from);
    read(node, "to", each.to);
    read(node, "value", each.value);
  }
  return drawn;
}

void write_drawn(Writer& writer, const std::vector<DrawnValue>& drawn) {
  if (drawn.empty()) return;
  writer.open("drawn");
  for (const DrawnValue& each : drawn) {
    writer.begin_item();
    writer.text("key", each.key);
    writer.text("from", each.from);
    writer.text("to", each.to);
    writer.text("value", each.value);
    writer.end_item();
  }
  writer.close();
}

}  // namespace yaml
}  // namespace parhelion
