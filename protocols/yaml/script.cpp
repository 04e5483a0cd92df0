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

using Action = AgentCommand::Action;
constexpr const char* everyone = "all";

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
  /// Those who appear later can be named in any script.
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
      problems_.add(name.line, "'near': how near? add a distance, such as 'distance: 2 m'");
    if (name.text != kTrainee) check_agent(name);
    const Node* subject = node.find("subject");
    if (subject != nullptr && subject->text != kTrainee) check_agent(*subject);
    if (trigger.subject == trigger.object)
      problems_.add(name.line, "'near': " + in_quotes(name.text) + " is always near itself");
  }

  AgentCommand read_action(const Node& node) {
    AgentCommand command;
    const Node* what = only_one(
        node, {"spawn", "behave", "move", "remove", "freeze", "unfreeze", "remove_all"}, "'do'", problems_);
    if (what == nullptr) return command;
    for (const Action action : {Action::spawn, Action::behave, Action::move, Action::remove, Action::freeze,
                                Action::unfreeze, Action::remove_all}) {
      if (what == node.find(to_string(action))) command.action = action;
    }
    if (command.action == Action::spawn) {
      command.agent = read_agent(*what, problems_);
    } else if (command.action == Action::remove_all) {
      if (what->text != "true") problems_.add(what->line, "'remove_all': expected true, or leave it out");
    } else {
      read_named(*what, command);
    }
    return command;
  }

  void read_named(const Node& what, AgentCommand& command) {
    const bool plain = what.kind == Node::Kind::scalar;
    const Node& name = plain ? what : *what.find("name");
    const bool everybody = plain && command.action != Action::remove && name.text == everyone;
    if (everybody) return;
    command.agent.name = name.text;
    check_agent(name);
    if (command.action == Action::behave)
      read_behaviour(*what.find("behaviour"), command.agent.behaviour, problems_);
    if (command.action == Action::move) read_agent_pose(what, command.agent, problems_);
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

void write_action(Writer& writer, const AgentCommand& command) {
  const char* key = to_string(command.action);
  writer.begin_item();
  switch (command.action) {
    case Action::spawn:
    case Action::behave:
    case Action::move:
      writer.open(key);
      if (command.action == Action::spawn) {
        write_agent(writer, command.agent);
      } else {
        writer.text("name", command.agent.name);
        if (command.action == Action::behave) write_behaviour(writer, command.agent.behaviour);
        if (command.action == Action::move)
          writer.line("pose", format_isometry(command.agent.T_map_base.isometry()));
      }
      writer.close();
      break;
    case Action::remove_all:
      writer.flag(key, true);
      break;
    default:
      writer.text(key, command.agent.name.empty() ? everyone : command.agent.name);
  }
  writer.end_item();
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
    for (const AgentCommand& command : script.actions) write_action(writer, command);
    writer.close();
    writer.end_item();
  }
  writer.close();
}

}  // namespace parhelion::yaml
