// The start of a training that waits for it: until then agents, scripts, timers and the grading stand still.
#pragma once

#include "protocols/bus/bus.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/fault_path.hpp"
#include "server/tick/pose_path.hpp"
#include "server/tick/scripts.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// Dependencies of the start.
struct StartPath {
  bool& waiting;
  simulation::Simulation& simulation;
  Scripts& scripts;
  FaultState& faults;
};

/// True if a session of this scenario waits when it begins.
bool waits_for_start(const Scenario& scenario);

/// Starts the training now, and reports it. `by`: the robot that was commanded or moved; empty: the
/// instructor's start. Does nothing if it does not wait.
void start_training(const TickContext& context, const std::string& by, const StartPath& path);
/// Starts it if this command is one to move a graded robot. `robot`: that it is for.
void start_on_command(const TickContext& context, InputKind kind, const std::string& robot,
                      const Message& input, const StartPath& path);
/// At each step while it waits: the clock stands at zero. A graded real robot that moves starts it: it is
/// driven, if by a console whose messages the server does not receive.
void watch_start(const TickContext& context, const RealRobots& robots, const StartPath& path);

}  // namespace parhelion::tick
