// Any sequence of commands to a simulation: it continues, everything started is stopped once or still active
// at the end, and the same commands give the same events.
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <map>
#include <set>
#include <tuple>

#include "server/simulation/building/planar.hpp"
#include "worlds.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

SemanticModel site() {
  SemanticModel model = room(10);
  model.entities.push_back(model_box("wall 5", EntityLabel::wall, {2, -2.75, 1.25}, {0.1, 4.5, 2.5}));
  model.entities.push_back(model_box("wall 6", EntityLabel::wall, {2, 2.75, 1.25}, {0.1, 4.5, 2.5}));
  ModelEntity door = model_box("door 1", EntityLabel::door, {2, 0, 1.0}, {1.0, 0.04, 2.0});
  door.T_map_body = Transform<Map, Body>::planar(2, 0, std::numbers::pi / 2, 1.0);
  door.is_virtual = true;
  door.hinge = Hinge{{-0.5, 0}, 0, std::numbers::pi / 2, 0};
  model.entities.push_back(door);
  return model;
}

struct Order {
  int what = 0, who = 0;
  double x = 0, y = 0, yaw = 0;
  int steps = 0;
};

std::vector<Order> any_orders() {
  const int count = *rc::gen::inRange(1, 25);
  std::vector<Order> orders;
  for (int i = 0; i < count; ++i) {
    Order order;
    order.what = *rc::gen::inRange(0, 16);
    order.who = *rc::gen::inRange(0, 5);
    order.x = 0.1 * *rc::gen::inRange(-48, 49);
    order.y = 0.1 * *rc::gen::inRange(-48, 49);
    order.yaw = 0.1 * *rc::gen::inRange(-31, 32);
    order.steps = *rc::gen::inRange(0, 150);
    orders.push_back(order);
  }
  return orders;
}

void command(Simulation& simulation, const Order& order, const std::optional<RealRobotState>& real) {
  AgentDefinition definition = agent("agent" + std::to_string(order.who),
                                     static_cast<AgentKind>(order.who % 4), order.x, order.y, order.yaw);
  definition.behaviour.kind =
      static_cast<BehaviourKind>(order.steps % (static_cast<int>(kLastBehaviourKind) + 1));
  definition.behaviour.speed = 0.3 + std::abs(order.x) / 4;
  definition.behaviour.yields = order.steps % 3 == 0;
  definition.behaviour.waypoints = {{-order.x, order.y}, {order.y, order.x}};
  const std::string& name = definition.name;
  const std::array<AgentCommand, 9> commands{
      AgentSpawn{.agent = definition}, AgentSpawn{.agent = definition},
      AgentSpawn{.agent = definition}, AgentMove{.agent = name, .T_map_base = definition.T_map_base},
      AgentRemove{.agent = name},      AgentBehaviour{.agent = name, .behaviour = definition.behaviour},
      AgentFreeze{.agent = name},      AgentFreeze{.agent = name, .frozen = false},
      AgentRemove{.all = true}};
  if (order.what < 9) {
    (void)simulation.command(commands[static_cast<std::size_t>(order.what)], real);
  } else {
    (void)simulation.set_door(
        {.door = "door 1", .opening = order.what == 9 ? std::optional(order.yaw) : std::nullopt});
  }
}

std::vector<Event> run_orders(const std::vector<Order>& orders) {
  SimulationOptions options;
  options.level = 1;
  options.zones = {{"yard", {{-2, -2}, {2, -2}, {2, 2}, {-2, 2}}}};
  Simulation simulation = make(site(), options);
  std::optional<RealRobotState> real;
  std::vector<LaserRequest> requests;
  std::vector<Event> events;
  for (const Order& order : orders) {
    const std::string name = "agent" + std::to_string(order.who);
    if (order.what <= 10) {
      command(simulation, order, real);
    } else if (order.what == 11) {
      real = real_at(order.x, order.y, order.yaw, {order.x / 4, 0, order.y / 4});
      real->relocalized = order.steps % 2 == 0;
    } else if (order.what == 12) {
      real.reset();
    } else if (order.what == 13) {
      (void)simulation.set_building(site());
    } else if (order.what == 14) {
      simulation.teleop(name, {order.x, order.y, order.yaw});
      simulation.show(name, static_cast<AgentShown>(order.steps % 3));
    } else {
      simulation.set_real_obstacles({{{order.x, order.y}, 0.3}});
    }
    for (int i = 0; i < order.steps; ++i) {
      simulation.step(real, requests);
      if (!real) continue;
      const Pose2 next = advance(planar_pose(real->T_map_base), real->twist, 1.0 / 240);
      real->T_map_base = Transform<Map, Base>::planar(next.x, next.y, next.yaw);
      real->relocalized = false;
    }
    for (Event& event : simulation.take_events()) events.push_back(std::move(event));
  }
  return events;
}

void check_streams(const std::vector<Event>& events) {
  const std::map<EventKind, std::pair<int, bool>> kinds{
      {EventKind::contact_started, {0, true}},  {EventKind::contact_ended, {0, false}},
      {EventKind::movement_started, {1, true}}, {EventKind::movement_stopped, {1, false}},
      {EventKind::zone_entered, {2, true}},     {EventKind::zone_left, {2, false}},
      {EventKind::agent_spawned, {3, true}},    {EventKind::agent_removed, {3, false}}};
  std::set<std::tuple<int, std::string, std::string>> open;
  SimulationTime last = kStart;
  for (const Event& event : events) {
    RC_ASSERT(event.stamp >= last);
    last = event.stamp;
    RC_ASSERT(event.position.allFinite() && std::isfinite(event.impulse) && std::isfinite(event.value));
    if (event.kind == EventKind::contact_continues)
      RC_ASSERT(open.contains({0, event.subject, event.object}));
    const auto kind = kinds.find(event.kind);
    if (kind == kinds.end()) continue;
    const auto [stream, starts] = kind->second;
    const std::tuple key(stream, event.subject, event.object);
    RC_ASSERT(open.contains(key) != starts);
    if (starts)
      open.insert(key);
    else
      open.erase(key);
    if (stream != 3 || starts) continue;
    // Removed agents have nothing active.
    for (const auto& [number, subject, object] : open) {
      RC_ASSERT(subject != event.subject);
      RC_ASSERT(object != event.subject);
    }
  }
}

RC_GTEST_PROP(EventStreams, EachStartedEventStopsOnceOrStaysOpen, ()) {
  const std::vector<Order> orders = any_orders();
  const std::vector<Event> events = run_orders(orders);
  check_streams(events);
  if (orders.size() % 8 != 0) return;
  const std::vector<Event> again = run_orders(orders);
  RC_ASSERT(events.size() == again.size());
  for (std::size_t i = 0; i < events.size(); ++i) {
    RC_ASSERT(events[i].kind == again[i].kind && events[i].subject == again[i].subject);
    RC_ASSERT(events[i].stamp == again[i].stamp && events[i].position == again[i].position);
  }
}

}  // namespace
}  // namespace parhelion::simulation
