#include "protocols/yaml/script.hpp"

#include <algorithm>
#include <map>

#include "protocols/channel_map.hpp"
#include "protocols/nearest_name.hpp"
#include "protocols/yaml/agent.hpp"
#include "protocols/yaml/choice.hpp"
#include "protocols/yaml/parts.hpp"
#include "protocols/yaml/schema.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion::yaml {
namespace {

constexpr const char* kEveryone = "all";

std::string in_quotes(std::string_view text) { return "'" + printable(text) + "'"; }

/// Reads one list of scripts.
class Reader {
 public:
  Reader(const std::vector<AgentDefinition>& agents, Problems& problems) : problems_(problems) {
    for (const AgentDefinition& agent : agents) agents_.push_back(agent.name);
  }

  std::vector<Script> read(const Node& list) {
    for (const Node& script : list.items) learn_agents(*script.find("do"));
    std::vector<Script> scripts;
    std::map<std::string, int> lines;
    for (const Node& node : list.items) {
      scripts.push_back(read_script(node));
      const int line = node.find("name")->line;
      const auto [known, inserted] = lines.emplace(scripts.back().name, line);
      if (!inserted) {
        problems_.add(line, "name " + in_quotes(scripts.back().name) + " is taken by the script in line " +
                                std::to_string(known->second) + ": names must be unique");
      }
    }
    return scripts;
  }

 private:
  /// Agents that are spawned later can be named in any script.
  void learn_agents(const Node& actions) {
    for (const Node& action : actions.items) {
      const Node* spawn = action.find("spawn");
      if (spawn == nullptr) continue;
      const Node& name = *spawn->find("name");
      if (const std::string fault = agent_name_fault(name.text); !fault.empty())
        problems_.add(name.line, "'name' of an agent, part of channel names: " + fault);
      agents_.push_back(name.text);
    }
  }

  void check_agent(const Node& name) {
    if (std::find(agents_.begin(), agents_.end(), name.text) != agents_.end()) return;
    problems_.add(name.line, "no agent " + in_quotes(name.text) + " in 'agents' or spawned by a script" +
                                 suggestion(name.text, agents_));
  }

  Script read_script(const Node& node) {
    Script script;
    yaml::read(node, "name", script.name);
    script.when = read_trigger(*node.find("when"));
    yaml::read(node, "after", script.after);
    yaml::read(node, "repeat", script.repeat);
    if (script.repeat && script.when.kind == ScriptTrigger::Kind::time && !(script.when.time > 0))
      problems_.add(node.line, "'repeat': expected a time above 0 s in 'when', which is the period");
    for (const Node& action : node.find("do")->items) script.actions.push_back(read_action(action));
    return script;
  }

  ScriptTrigger read_trigger(const Node& node) {
    ScriptTrigger trigger;
    const Node* what = only_one(node, {"time", "event", "zone", "near"}, "'when'", problems_);
    yaml::read(node, "subject", trigger.subject);
    yaml::read(node, "object", trigger.object);
    if (what == nullptr) return trigger;
    const auto misplaced = [&](const char* key) {
      if (const Node* here = node.find(key))
        problems_.add(here->line, std::string("'when': ") + key + " does not go with this trigger");
    };
    if (node.find("near") == nullptr) misplaced("distance");
    if (node.find("event") == nullptr) misplaced("object");
    if (what == node.find("time")) {
      misplaced("subject");
      yaml::read(node, "time", trigger.time);
    } else if (what == node.find("event")) {
      trigger.kind = ScriptTrigger::Kind::event;
      if (const auto kind = read_event_kind(*what, problems_)) trigger.event = *kind;
    } else if (what == node.find("zone")) {
      trigger.kind = ScriptTrigger::Kind::event;
      trigger.event = EventKind::zone_entered;
      trigger.object = what->text;
    } else {
      read_near(node, *what, trigger);
    }
    return trigger;
  }

  void read_near(const Node& node, const Node& name, ScriptTrigger& trigger) {
    trigger.kind = ScriptTrigger::Kind::near;
    trigger.object = name.text;
    if (trigger.subject.empty()) trigger.subject = kTrainee;
    yaml::read(node, "distance", trigger.distance);
    if (node.find("distance") == nullptr)
      problems_.add(name.line, "'near': a distance is missing; add one, such as 'distance: 2 m'");
    if (name.text != kTrainee) check_agent(name);
    const Node* subject = node.find("subject");
    if (subject != nullptr && subject->text != kTrainee) check_agent(*subject);
    if (trigger.subject == trigger.object)
      problems_.add(name.line, "'near': " + in_quotes(name.text) + " is always near itself");
  }

  AgentCommand read_action(const Node& node) {
    const Node* what = only_one(
        node, {"spawn", "behave", "move", "remove", "freeze", "unfreeze", "remove_all"}, "'do'", problems_);
    if (what == nullptr) return {};
    if (what == node.find("spawn")) return AgentSpawn{.agent = read_agent(*what, problems_)};
    if (what == node.find("remove_all")) {
      if (what->text != "true") problems_.add(what->line, "'remove_all': expected true, or omit it");
      return AgentRemove{.all = true};
    }
    if (what == node.find("remove")) return AgentRemove{.agent = read_name(*what)};
    if (what == node.find("behave")) return read_behave(*what);
    if (what == node.find("move")) return read_move(*what);
    return read_freeze(*what, what == node.find("freeze"));
  }

  AgentBehaviour read_behave(const Node& what) {
    AgentBehaviour command;
    command.agent = read_name(*what.find("name"));
    read_behaviour(*what.find("behaviour"), command.behaviour, problems_);
    return command;
  }

  AgentMove read_move(const Node& what) {
    AgentMove command;
    command.agent = read_name(*what.find("name"));
    read_agent_pose(what, command.T_map_base, problems_);
    return command;
  }

  AgentFreeze read_freeze(const Node& name, bool frozen) {
    if (name.text == kEveryone) return {.all = true, .frozen = frozen};
    return {.agent = read_name(name), .frozen = frozen};
  }

  std::string read_name(const Node& name) {
    check_agent(name);
    return name.text;
  }

  Problems& problems_;
  std::vector<std::string> agents_;
};

void write_trigger(Writer& writer, const ScriptTrigger& when) {
  writer.open("when");
  switch (when.kind) {
    case ScriptTrigger::Kind::time:
      writer.quantity("time", when.time, Quantity::time);
      break;
    case ScriptTrigger::Kind::event:
      writer.word("event", to_string(when.event));
      if (!when.object.empty()) writer.text("object", when.object);
      break;
    case ScriptTrigger::Kind::near:
      writer.text("near", when.object);
      writer.quantity("distance", when.distance, Quantity::length);
      break;
  }
  if (!when.subject.empty()) writer.text("subject", when.subject);
  writer.close();
}

void write_action(Writer& writer, const AgentSpawn& command) {
  writer.open("spawn");
  write_agent(writer, command.agent);
  writer.close();
}

void write_action(Writer& writer, const AgentMove& command) {
  writer.open("move");
  writer.text("name", command.agent);
  writer.line("pose", format_isometry(command.T_map_base.isometry()));
  writer.close();
}

void write_action(Writer& writer, const AgentBehaviour& command) {
  writer.open("behave");
  writer.text("name", command.agent);
  write_behaviour(writer, command.behaviour);
  writer.close();
}

void write_action(Writer& writer, const AgentRemove& command) {
  if (command.all) return writer.flag("remove_all", true);
  writer.text("remove", command.agent);
}

void write_action(Writer& writer, const AgentFreeze& command) {
  writer.text(command.frozen ? "freeze" : "unfreeze", command.all ? kEveryone : command.agent);
}

}  // namespace

std::vector<Script> read_scripts(const Node& list, const std::vector<AgentDefinition>& agents,
                                 Problems& problems) {
  return Reader(agents, problems).read(list);
}

void write_scripts(Writer& writer, const std::vector<Script>& scripts) {
  if (scripts.empty()) return;
  writer.open("scripts");
  for (const Script& script : scripts) {
    writer.begin_item();
    writer.text("name", script.name);
    write_trigger(writer, script.when);
    writer.quantity("after", script.after, Quantity::time);
    if (script.repeat) writer.flag("repeat", true);
    writer.open("do");
    for (const AgentCommand& command : script.actions) {
      writer.begin_item();
      std::visit([&](const auto& each) { write_action(writer, each); }, command);
      writer.end_item();
    }
    writer.close();
    writer.end_item();
  }
  writer.close();
}

}  // namespace parhelion::yaml
