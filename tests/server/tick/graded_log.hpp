// A graded session log, written without a server.
#pragma once

#include <string>
#include <vector>

#include "protocols/channels.hpp"
#include "tests/server/tick/synthetic.hpp"

namespace parhelion::test {

/// "lesson" in the synthetic room: 50 points for the hall (reached at second 1), 50 for the yard (if `yard`),
/// 7 deducted for each of `collisions`. `number` is its seed; `worlds` states of the world, 30 a second.
inline std::vector<Message> lesson(int number, int collisions, bool yard, int worlds = 30) {
  Scenario scenario;
  scenario.name = "lesson";
  scenario.seed = static_cast<std::uint64_t>(number);
  Training& training = scenario.training.emplace();
  training.on_command = false;
  for (const char* name : {"hall", "yard"}) {
    const double x = scenario.zones.empty() ? 1 : -1;
    scenario.zones.emplace_back();
    scenario.zones.back().name = name;
    scenario.zones.back().outline = {{x - 0.5, -0.5}, {x + 0.5, -0.5}, {x + 0.5, 0.5}, {x - 0.5, 0.5}};
    Task task;
    task.name = std::string("into the ") + name;
    task.points = 50;
    task.done.kind = Condition::Kind::reach;
    task.done.target = name;
    task.skills = {std::string(name) + " driving"};
    training.tasks.push_back(task);
  }
  training.pass_mark = 0.6;
  training.penalties.emplace_back();
  training.penalties[0].name = "collision";
  training.penalties[0].points = 7;
  auto configured = tick::configure(scenario, robot(), room());
  EXPECT_TRUE(configured.ok()) << configured.error().message;
  const auto event = [](double t, EventKind kind, const std::string& object) {
    Event happened;
    happened.stamp = SimulationTime::from_utime(kStartUs) + seconds(t);
    happened.kind = kind;
    happened.subject = "synthetic";
    happened.object = object;
    return message(channel::kMrEvents, happened.stamp.utime(), happened);
  };
  std::vector<Message> log;
  log.push_back(message(channel::kMrSession, kStartUs,
                        tick::session_header(*configured, SensorTime::from_utime(kStartUs))));
  log.push_back(event(1, EventKind::zone_entered, "hall"));
  for (int i = 0; i < collisions; ++i)
    log.push_back(event(1.1 + 0.01 * i, EventKind::contact_started, "wall 1"));
  if (yard) log.push_back(event(2, EventKind::zone_entered, "yard"));
  for (int i = 0; i < worlds; ++i) {
    WorldMessage world;
    world.stamp = SensorTime::from_utime(kStartUs + 3'000'000 + i * 1'000'000LL / 30);
    world.step = static_cast<std::uint64_t>(i);
    world.bodies.emplace_back();
    world.bodies.back().entity = "synthetic";
    log.push_back(message(channel::kMrWorld, world.stamp.utime(), world));
  }
  LoopDecision end;
  end.kind = LoopDecision::Kind::ended;
  end.stamp = SensorTime::from_utime(log.back().arrival.utime() + 1);
  log.push_back(message(channel::kLoop, end.stamp.utime(), end));
  return log;
}

}  // namespace parhelion::test
