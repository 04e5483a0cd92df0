#include "protocols/yaml/faults.hpp"

#include <array>

#include "protocols/yaml/parts.hpp"

namespace parhelion {

const char* to_string(Fault::Kind kind) {
  switch (kind) {
    case Fault::Kind::camera_delay:
      return "camera_delay";
    case Fault::Kind::camera_loss:
      return "camera_loss";
    case Fault::Kind::laser_dropouts:
      return "laser_dropouts";
    case Fault::Kind::low_battery:
      return "low_battery";
    case Fault::Kind::dead_wheel:
      return "dead_wheel";
  }
  return "unknown";
}

namespace yaml {
namespace {

using Kind = Fault::Kind;
constexpr std::array<Kind, 5> kKinds{Kind::camera_delay, Kind::camera_loss, Kind::laser_dropouts,
                                     Kind::low_battery, Kind::dead_wheel};

Fault read_fault(const Node& node, int level, Problems& problems) {
  Fault fault;
  const Node* found = nullptr;
  std::string names;
  for (const Kind kind : kKinds) {
    names += (names.empty() ? "" : ", ") + std::string(to_string(kind));
    const Node* here = node.find(to_string(kind));
    if (!here) continue;
    if (found) problems.add(here->line, "a fault: found two, expected one; list them separately");
    found = here;
    fault.kind = kind;
  }
  if (!found) {
    problems.add(node.line, "a fault: expected one of " + names);
    return fault;
  }
  if (fault.kind == Kind::dead_wheel) {
    fault.right = found->text == "right";
  } else {
    fault.amount = found->number;
  }
  read(node, "after", fault.after);
  if (node.find("for")) read(node, "for", fault.lasting.emplace());
  if (fault.kind == Kind::low_battery && (fault.after > 0 || fault.lasting))
    problems.add(found->line,
                 "'low_battery' sets the charge at the start: 'after' and 'for' are not allowed");
  if (level >= 3 && needs_simulated_robot(fault.kind))
    problems.add(found->line, std::string("'") + to_string(fault.kind) +
                                  "' is a fault of simulated robots: at level 3 the robot is real, and its "
                                  "sensors and drive are not changed; use level 1 or 2");
  return fault;
}

}  // namespace

std::vector<Fault> read_faults(const Node& list, int level, Problems& problems) {
  std::vector<Fault> faults;
  for (const Node& node : list.items) faults.push_back(read_fault(node, level, problems));
  return faults;
}

void write_faults(Writer& writer, const std::vector<Fault>& faults) {
  if (faults.empty()) return;
  writer.open("faults");
  for (const Fault& fault : faults) {
    writer.begin_item();
    const char* name = to_string(fault.kind);
    if (fault.kind == Kind::dead_wheel) {
      writer.word(name, fault.right ? "right" : "left");
    } else if (fault.kind == Kind::camera_delay) {
      writer.quantity(name, fault.amount, Quantity::time);
    } else {
      writer.number(name, fault.amount);
    }
    if (fault.after > 0) writer.quantity("after", fault.after, Quantity::time);
    if (fault.lasting) writer.quantity("for", *fault.lasting, Quantity::time);
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
