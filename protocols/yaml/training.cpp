#include "protocols/yaml/training.hpp"

#include <algorithm>
#include <array>
#include <map>

#include "protocols/yaml/choice.hpp"
#include "protocols/yaml/parts.hpp"
#include "protocols/yaml/schema.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion::yaml {
namespace {

using Kind = Condition::Kind;
constexpr std::array<const char*, 20> kKinds{
    "event", "reach", "pass",  "climb", "near", "still",    "inspect", "follow", "avoid", "report",
    "grip",  "lift",  "place", "pitch", "roll", "yaw_rate", "speed",   "all",    "any",   "then"};

/// Quantity of the kind's own number, for kinds that have one.
std::optional<Quantity> quantity_of(Kind kind) {
  switch (kind) {
    case Kind::still:
      return Quantity::time;
    case Kind::pitch:
    case Kind::roll:
      return Quantity::angle;
    case Kind::yaw_rate:
      return Quantity::angular_speed;
    case Kind::speed:
      return Quantity::speed;
    default:
      return std::nullopt;
  }
}

bool takes_distance(Kind kind) {
  return kind == Kind::near || kind == Kind::inspect || kind == Kind::follow || kind == Kind::avoid ||
         kind == Kind::report;
}

bool takes_duration(Kind kind) {
  return (takes_distance(kind) && kind != Kind::report) || (quantity_of(kind) && kind != Kind::still);
}

/// Keys allowed for a kind, besides its own, `within` and `never`.
bool goes_with(Kind kind, const std::string& key) {
  const auto one_of = [&key](std::initializer_list<const char*> keys) {
    return std::find(keys.begin(), keys.end(), key) != keys.end();
  };
  if (one_of({"within", "never"})) return true;
  if (kind == Kind::event) return one_of({"subject", "object", "text", "impulse", "min", "max", "count"});
  if (kind == Kind::place && key == "into") return true;
  return (takes_distance(kind) && key == "distance") || (takes_duration(kind) && key == "for");
}

void read_optional(const Node& node, const char* key, std::optional<double>& out) {
  if (node.find(key)) read(node, key, out.emplace());
}

/// s, minimum time until it can hold.
double min_time(const Condition& condition) {
  double time = condition.duration;
  for (const Condition& part : condition.parts) {
    const double part_time = min_time(part);
    if (condition.kind == Kind::all) time = std::max(time, part_time);
    if (condition.kind == Kind::then) time += part_time;
  }
  if (condition.kind == Kind::any) {
    const auto shortest =
        std::min_element(condition.parts.begin(), condition.parts.end(),
                         [](const Condition& a, const Condition& b) { return min_time(a) < min_time(b); });
    if (shortest != condition.parts.end()) time = min_time(*shortest);
  }
  return time;
}

std::string seconds_text(double time) { return format_quantity(time, Quantity::time); }

/// Reports conditions that cannot be met in time, whatever the trainee does.
void check_times(const Training& training, const Node& tasks, Problems& problems) {
  double before = 0;
  for (std::size_t i = 0; i < training.tasks.size(); ++i) {
    const Task& task = training.tasks[i];
    const double min = min_time(task.done);
    const auto add_problem = [&](const std::string& words) {
      problems.add(tasks.items[i].line, "task '" + printable(task.name) + "': " + words);
    };
    if (task.done.within && min > *task.done.within)
      add_problem("its condition takes at least " + seconds_text(min) + ", and has to be within " +
                  seconds_text(*task.done.within));
    if (task.limit && min > *task.limit)
      add_problem("it takes at least " + seconds_text(min) + ", its limit is " + seconds_text(*task.limit));
    if (training.limit && task.limit && *task.limit > *training.limit)
      add_problem("its limit of " + seconds_text(*task.limit) + " is after that of the whole, " +
                  seconds_text(*training.limit));
    if (training.limit && before + min > *training.limit)
      add_problem("it cannot be done in time: the tasks up to it take at least " +
                  seconds_text(before + min) + ", the limit of the whole is " +
                  seconds_text(*training.limit));
    if (training.in_order) before += min;
  }
}

class Reader {
 public:
  explicit Reader(Problems& problems) : problems_(problems) {}

  Condition read_condition(Node& node) {
    Condition condition;
    check(node, "condition", problems_);
    const Node* what = nullptr;
    if (node.kind == Node::Kind::map) what = what_kind(node, condition.kind);
    if (!what) return condition;
    for (std::size_t i = 0; i < node.keys.size(); ++i) {
      const std::string& key = node.keys[i];
      const bool known = std::find(kKinds.begin(), kKinds.end(), key) != kKinds.end();
      if (!known && !goes_with(condition.kind, key))
        problems_.add(node.key_lines[i],
                      "'" + printable(key) + "' does not go with '" + name_of(condition) + "'");
    }
    read_details(node, *what, condition);
    if (Node* never = node.find("never")) condition.never.push_back(read_condition(*never));
    return condition;
  }

 private:
  static std::string name_of(const Condition& condition) {
    return kKinds[static_cast<std::size_t>(condition.kind)];
  }

  const Node* what_kind(const Node& node, Kind& kind) {
    const Node* what = only_one(node, {kKinds.begin(), kKinds.end()}, "a condition", problems_,
                                "; join them with all, any or then");
    for (std::size_t i = 0; what && i < kKinds.size(); ++i) {
      if (what == node.find(kKinds[i])) kind = static_cast<Kind>(i);
    }
    return what;
  }

  void read_details(Node& node, const Node& what, Condition& condition) {
    read_optional(node, "within", condition.within);
    switch (condition.kind) {
      case Kind::event:
        return read_event(node, what, condition);
      case Kind::all:
      case Kind::any:
      case Kind::then:
        for (Node& part : node.find(name_of(condition))->items)
          condition.parts.push_back(read_condition(part));
        return;
      default:
        break;
    }
    if (quantity_of(condition.kind)) {
      (condition.kind == Kind::still ? condition.duration : condition.amount) = what.number;
    } else {
      condition.target = what.text;
    }
    read(node, "into", condition.into);
    read(node, "distance", condition.distance);
    read(node, "for", condition.duration);
    const Kind kind = condition.kind;
    if ((kind == Kind::near || kind == Kind::inspect || kind == Kind::follow) && !node.find("distance"))
      problems_.add(what.line,
                    "'" + name_of(condition) + "': a distance is missing; add one, such as 'distance: 2 m'");
    if ((kind == Kind::follow || kind == Kind::avoid) && !(condition.duration > 0))
      problems_.add(what.line,
                    "'" + name_of(condition) + "': a time is missing; add one, such as 'for: 10 s'");
  }

  void read_event(const Node& node, const Node& what, Condition& condition) {
    const auto kind = read_event_kind(what, problems_);
    if (!kind) return;
    condition.event = *kind;
    if (is_grading(condition.event))
      problems_.add(what.line,
                    "'" + printable(what.text) + "' is reported by the grading itself and cannot be graded");
    read(node, "subject", condition.subject);
    read(node, "object", condition.object);
    read(node, "text", condition.text);
    read(node, "impulse", condition.impulse);
    read(node, "count", condition.count);
    read_optional(node, "min", condition.min);
    read_optional(node, "max", condition.max);
  }

  Problems& problems_;
};

std::vector<std::string> read_skills(const Node& task, Problems& problems) {
  std::vector<std::string> skills;
  const Node* list = task.find("skills");
  if (!list) return skills;
  for (const Node& skill : list->items) {
    if (std::find(skills.begin(), skills.end(), skill.text) != skills.end())
      problems.add(skill.line, "'skills': '" + printable(skill.text) + "' is a duplicate");
    skills.push_back(skill.text);
  }
  return skills;
}

Task read_task(Node& node, Reader& reader, Problems& problems) {
  Task task;
  read(node, "name", task.name);
  read(node, "text", task.text);
  read(node, "points", task.points);
  read(node, "required", task.required);
  task.skills = read_skills(node, problems);
  read_optional(node, "limit", task.limit);
  task.done = reader.read_condition(*node.find("done"));
  if (Node* failed = node.find("failed")) task.failed.push_back(reader.read_condition(*failed));
  return task;
}

Penalty read_penalty(Node& node, Reader& reader, Problems& problems) {
  Penalty penalty;
  read(node, "name", penalty.name);
  read(node, "points", penalty.points);
  read(node, "per_impulse", penalty.per_impulse);
  read_optional(node, "max", penalty.max);
  penalty.when = reader.read_condition(*node.find("when"));
  if (!(penalty.points > 0 || penalty.per_impulse > 0))
    problems.add(node.line,
                 "penalty '" + printable(penalty.name) + "' costs nothing: add points or per_impulse");
  return penalty;
}

void write_condition(Writer& writer, const Condition& condition);

void write_event(Writer& writer, const Condition& condition) {
  writer.word("event", to_string(condition.event));
  if (!condition.subject.empty()) writer.text("subject", condition.subject);
  if (!condition.object.empty()) writer.text("object", condition.object);
  if (!condition.text.empty()) writer.text("text", condition.text);
  if (condition.impulse > 0) writer.quantity("impulse", condition.impulse, Quantity::impulse);
  if (condition.min) writer.number("min", *condition.min);
  if (condition.max) writer.number("max", *condition.max);
  if (condition.count > 1) writer.integer("count", condition.count);
}

void write_condition(Writer& writer, const Condition& condition) {
  const char* name = kKinds[static_cast<std::size_t>(condition.kind)];
  if (condition.kind == Kind::event) {
    write_event(writer, condition);
  } else if (const auto quantity = quantity_of(condition.kind)) {
    writer.quantity(name, condition.kind == Kind::still ? condition.duration : condition.amount, *quantity);
  } else if (!condition.parts.empty()) {
    writer.open(name);
    for (const Condition& part : condition.parts) {
      writer.begin_item();
      write_condition(writer, part);
      writer.end_item();
    }
    writer.close();
  } else {
    writer.text(name, condition.target);
  }
  if (!condition.into.empty()) writer.text("into", condition.into);
  if (takes_distance(condition.kind) && condition.distance > 0)
    writer.quantity("distance", condition.distance, Quantity::length);
  if (takes_duration(condition.kind) && condition.duration > 0)
    writer.quantity("for", condition.duration, Quantity::time);
  if (condition.within) writer.quantity("within", *condition.within, Quantity::time);
  if (condition.never.empty()) return;
  writer.open("never");
  write_condition(writer, condition.never.front());
  writer.close();
}

void write_named(Writer& writer, const char* key, const Condition& condition) {
  writer.open(key);
  write_condition(writer, condition);
  writer.close();
}

}  // namespace

Training read_training(Node& node, Problems& problems) {
  Training training;
  Reader reader(problems);
  read(node, "robot", training.robot);
  read(node, "text", training.text);
  read_optional(node, "limit", training.limit);
  if (const Node* start = node.find("start")) training.on_command = start->text == "on command";
  if (const Node* order = node.find("order")) training.in_order = order->text == "listed";
  read(node, "pass_mark", training.pass_mark);
  if (const Node* contact = node.find("person_contact"))
    training.person_contact_fails = contact->text == "fails";
  std::map<std::string, int> lines;
  for (Node& task : node.find("tasks")->items) {
    training.tasks.push_back(read_task(task, reader, problems));
    const std::string& name = training.tasks.back().name;
    const auto [known, inserted] = lines.emplace(name, task.line);
    if (!inserted)
      problems.add(task.line, "name '" + printable(name) + "' is taken by the task in line " +
                                  std::to_string(known->second) + ": names must be unique");
    const auto& limit = training.tasks.back().limit;
    const auto& within = training.tasks.back().done.within;
    if (limit && within && *within > *limit)
      problems.add(task.line, "task '" + printable(name) + "': its condition may take longer than its limit");
  }
  check_times(training, *node.find("tasks"), problems);
  if (const Node* grades = node.find("grades")) {
    for (const Node& grade : grades->items) {
      GradeStep step;
      read(grade, "name", step.name);
      read(grade, "from", step.from);
      if (!training.grades.empty() && !(step.from < training.grades.back().from))
        problems.add(grade.line,
                     "'grades': expected the best first, each from a lower fraction than the previous one");
      training.grades.push_back(step);
    }
  }
  if (Node* penalties = node.find("penalties")) {
    for (Node& penalty : penalties->items)
      training.penalties.push_back(read_penalty(penalty, reader, problems));
  }
  return training;
}

void write_training(Writer& writer, const Training& training) {
  writer.open("training");
  if (!training.robot.empty()) writer.text("robot", training.robot);
  if (!training.text.empty()) writer.text("text", training.text);
  if (training.limit) writer.quantity("limit", *training.limit, Quantity::time);
  writer.word("start", training.on_command ? "on command" : "with session");
  writer.word("order", training.in_order ? "listed" : "free");
  writer.number("pass_mark", training.pass_mark);
  if (!training.person_contact_fails) writer.word("person_contact", "penalties_decide");
  if (!training.grades.empty()) {
    writer.open("grades");
    for (const GradeStep& grade : training.grades) {
      writer.begin_item();
      writer.text("name", grade.name);
      writer.number("from", grade.from);
      writer.end_item();
    }
    writer.close();
  }
  writer.open("tasks");
  for (const Task& task : training.tasks) {
    writer.begin_item();
    writer.text("name", task.name);
    if (!task.text.empty()) writer.text("text", task.text);
    writer.number("points", task.points);
    if (task.required) writer.flag("required", true);
    if (!task.skills.empty()) {
      writer.open("skills");
      for (const std::string& skill : task.skills) writer.item(Writer::quote(skill));
      writer.close();
    }
    if (task.limit) writer.quantity("limit", *task.limit, Quantity::time);
    write_named(writer, "done", task.done);
    if (!task.failed.empty()) write_named(writer, "failed", task.failed.front());
    writer.end_item();
  }
  writer.close();
  if (!training.penalties.empty()) {
    writer.open("penalties");
    for (const Penalty& penalty : training.penalties) {
      writer.begin_item();
      writer.text("name", penalty.name);
      writer.number("points", penalty.points);
      if (penalty.per_impulse > 0) writer.number("per_impulse", penalty.per_impulse);
      if (penalty.max) writer.number("max", *penalty.max);
      write_named(writer, "when", penalty.when);
      writer.end_item();
    }
    writer.close();
  }
  writer.close();
}

}  // namespace parhelion::yaml
