// parse(to_yaml(x)) == x, to the bit, for any valid scenario.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "any_values.hpp"
#include "protocols/scenario.hpp"

namespace parhelion {
namespace {

using namespace test;

Behaviour any_valid_behaviour() {
  Behaviour behaviour;
  behaviour.kind = any_of<BehaviourKind>(static_cast<int>(kLastBehaviourKind) + 1);
  behaviour.speed = positive();
  for (int k = *rc::gen::inRange(1, 4); k > 0; --k) behaviour.waypoints.push_back({finite(), finite()});
  behaviour.target = text();
  behaviour.distance = positive();
  behaviour.yields = *rc::gen::arbitrary<bool>();
  behaviour.opens_doors = *rc::gen::arbitrary<bool>();
  return behaviour;
}

AgentDefinition any_agent(int number) {
  AgentDefinition agent;
  agent.name = "Agent_" + std::to_string(number) + "-x";
  agent.kind = any_of<AgentKind>(4);
  agent.T_map_base = upright<Map, Base>();
  agent.size = {between(1e-3, 9e3), between(1e-3, 9e3), between(1e-3, 9e3)};
  agent.behaviour = any_valid_behaviour();
  agent.laser = text();
  if (agent.kind == AgentKind::robot) agent.model = text();
  if (!agent.model.empty() && *rc::gen::arbitrary<bool>()) agent.camera_rate = between(0.1, 2);
  return agent;
}

void expect_same(const Behaviour& x, const Behaviour& y) {
  RC_ASSERT(x.kind == y.kind && x.speed == y.speed && x.waypoints == y.waypoints);
  RC_ASSERT(x.target == y.target && x.distance == y.distance);
  RC_ASSERT(x.yields == y.yields && x.opens_doors == y.opens_doors);
}

ScriptTrigger any_trigger() {
  using Kind = ScriptTrigger::Kind;
  ScriptTrigger when;
  when.kind = any_of<Kind>(3);
  if (when.kind == Kind::time) {
    when.time = positive();
    return when;
  }
  when.subject = kTrainee;
  when.object = when.kind == Kind::near ? "Agent_1-x" : "door " + text();
  if (when.kind == Kind::near) when.distance = positive();
  if (when.kind == Kind::event) when.event = any_of<EventKind>(static_cast<int>(kLastEventKind) + 1);
  return when;
}

AgentCommand any_action() {
  const std::string name = "Agent_1-x";
  const bool all = *rc::gen::arbitrary<bool>();
  switch (*rc::gen::inRange(0, 5)) {
    case 0: {
      AgentSpawn spawn{.agent = any_agent(9)};
      spawn.agent.name = name;
      return spawn;
    }
    case 1:
      return AgentMove{.agent = name, .T_map_base = upright<Map, Base>()};
    case 2:
      return AgentBehaviour{.agent = name, .behaviour = any_valid_behaviour()};
    case 3:
      return AgentRemove{.all = all, .agent = all ? "" : name};
    default:
      return AgentFreeze{.all = all, .agent = all ? "" : name, .frozen = *rc::gen::arbitrary<bool>()};
  }
}

Script any_script(int number) {
  Script script;
  script.name = "script " + std::to_string(number) + text();
  script.when = any_trigger();
  script.after = positive();
  script.repeat = *rc::gen::arbitrary<bool>();
  for (int k = *rc::gen::inRange(1, 4); k > 0; --k) script.actions.push_back(any_action());
  return script;
}

void expect_same(const AgentCommand& x, const AgentCommand& y) {
  RC_ASSERT(std::string(action_of(x)) == action_of(y));
  RC_ASSERT(subject_of(to_instructor_command(x)) == subject_of(to_instructor_command(y)));
  if (const auto* spawn = std::get_if<AgentSpawn>(&x)) {
    expect_same(spawn->agent.behaviour, std::get<AgentSpawn>(y).agent.behaviour);
    RC_ASSERT(same(spawn->agent.T_map_base, std::get<AgentSpawn>(y).agent.T_map_base));
  }
  if (const auto* move = std::get_if<AgentMove>(&x))
    RC_ASSERT(same(move->T_map_base, std::get<AgentMove>(y).T_map_base));
  if (const auto* changed = std::get_if<AgentBehaviour>(&x))
    expect_same(changed->behaviour, std::get<AgentBehaviour>(y).behaviour);
  if (const auto* freeze = std::get_if<AgentFreeze>(&x))
    RC_ASSERT(freeze->all == std::get<AgentFreeze>(y).all);
}

void expect_same(const Script& x, const Script& y) {
  RC_ASSERT(x.name == y.name && x.after == y.after && x.repeat == y.repeat);
  RC_ASSERT(x.when.kind == y.when.kind && x.when.time == y.when.time && x.when.event == y.when.event);
  RC_ASSERT(x.when.subject == y.when.subject && x.when.object == y.when.object);
  RC_ASSERT(x.when.distance == y.when.distance && x.actions.size() == y.actions.size());
  for (std::size_t i = 0; i < x.actions.size(); ++i) expect_same(x.actions[i], y.actions[i]);
}

RC_GTEST_PROP(RoundTrip, Scenario, ()) {
  Scenario a;
  a.name = text();
  a.level = *rc::gen::inRange(1, 4);
  a.seed = *rc::gen::arbitrary<std::uint64_t>();
  a.physics_rate = between(10, 10'000);
  a.model = text();
  a.robot = text();
  a.authentication = *rc::gen::arbitrary<bool>();
  if (*rc::gen::arbitrary<bool>()) a.hosts = {"192.168.1.20", "10.0.0.7"};
  a.mapping = *rc::gen::arbitrary<bool>();
  a.max_agents = static_cast<std::uint64_t>(*rc::gen::inRange(1, 10'001));
  a.max_agent_image_rate = between(10, 240);
  a.injection.max_error = positive();
  a.injection.restore = between(0, 1);
  a.contact.stop_distance = between(0, 1);
  a.contact.slow_distance = between(1.5, 3);
  a.contact.crawl_speed = positive();
  a.contact.silence = positive();
  if (*rc::gen::arbitrary<bool>())
    a.trainee = Trainee{"me", "m" + text(), upright<Map, Base>(), *rc::gen::arbitrary<bool>()};
  if (*rc::gen::arbitrary<bool>()) a.pose = PoseInput{positive(), positive(), text()};
  for (int i = *rc::gen::inRange(0, 5); i > 0; --i) {
    const AgentDefinition agent = any_agent(i);
    a.agents.push_back(agent);
  }
  if (!a.agents.empty()) {
    a.shown = {a.agents.front().name};
    for (int i = *rc::gen::inRange(0, 4); i > 0; --i) a.scripts.push_back(any_script(i));
  }
  if (*rc::gen::arbitrary<bool>()) a.channels = {{"SCAN", "a/b"}, {"MR_SCAN", "null"}, {"CAMERA", "7"}};

  const auto b = parse_scenario(to_yaml(a), "s.yaml");
  RC_ASSERT(b.ok());
  RC_ASSERT(b->name == a.name);
  RC_ASSERT(b->level == a.level);
  RC_ASSERT(b->seed == a.seed);
  RC_ASSERT(b->physics_rate == a.physics_rate);
  RC_ASSERT(b->model == a.model);
  RC_ASSERT(b->authentication == a.authentication);
  RC_ASSERT(b->hosts == a.hosts);
  RC_ASSERT(b->mapping == a.mapping);
  RC_ASSERT(b->max_agents == a.max_agents);
  RC_ASSERT(b->max_agent_image_rate == a.max_agent_image_rate);
  RC_ASSERT(b->robot == a.robot);
  RC_ASSERT(b->injection.max_error == a.injection.max_error);
  RC_ASSERT(b->injection.restore == a.injection.restore);
  RC_ASSERT(b->contact.slow_distance == a.contact.slow_distance);
  RC_ASSERT(b->contact.stop_distance == a.contact.stop_distance);
  RC_ASSERT(b->contact.crawl_speed == a.contact.crawl_speed);
  RC_ASSERT(b->contact.silence == a.contact.silence);
  RC_ASSERT(b->channels == a.channels);
  RC_ASSERT(b->trainee.has_value() == a.trainee.has_value());
  if (a.trainee) {
    RC_ASSERT(b->trainee->name == a.trainee->name && b->trainee->model == a.trainee->model);
    RC_ASSERT(b->trainee->slam == a.trainee->slam && same(b->trainee->T_map_base, a.trainee->T_map_base));
  }
  RC_ASSERT(b->pose.has_value() == a.pose.has_value());
  if (a.pose) {
    RC_ASSERT(b->pose->position_sigma == a.pose->position_sigma && b->pose->yaw_sigma == a.pose->yaw_sigma);
    RC_ASSERT(b->pose->map_id == a.pose->map_id);
  }
  RC_ASSERT(b->shown == a.shown);
  RC_ASSERT(b->agents.size() == a.agents.size());
  for (std::size_t i = 0; i < a.agents.size(); ++i) {
    const AgentDefinition &x = a.agents[i], &y = b->agents[i];
    RC_ASSERT(x.name == y.name && x.kind == y.kind && x.laser == y.laser && x.model == y.model);
    RC_ASSERT(x.camera_rate == y.camera_rate);
    RC_ASSERT(same(x.T_map_base, y.T_map_base));
    RC_ASSERT(x.size == y.size);
    expect_same(x.behaviour, y.behaviour);
  }
  RC_ASSERT(b->scripts.size() == a.scripts.size());
  for (std::size_t i = 0; i < a.scripts.size(); ++i) expect_same(a.scripts[i], b->scripts[i]);
}

}  // namespace
}  // namespace parhelion
