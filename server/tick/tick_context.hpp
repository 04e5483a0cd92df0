// Common arguments of every path, beside its own state.
#pragma once

#include <string>
#include <string_view>

#include "protocols/event.hpp"
#include "protocols/status.hpp"
#include "server/tick/configuration.hpp"
#include "server/tick/outputs.hpp"
#include "server/tick/tally.hpp"

namespace parhelion::tick {

class Scripts;
struct LiveGrading;

/// Receivers of an event within the tick.
struct EventListeners {
  Scripts& scripts;
  LiveGrading* grading;  ///< null: the scenario has no training
};

struct TickContext {
  const Configuration& configuration;
  SimulationTime now;  ///< arrival of the input, or instant of the physics step
  Outputs& outputs;
  EventListeners listeners;
  Tally& tally;
  std::size_t robot_index = 0;  ///< of the robot that the path is of; the first for those of the session

  const RobotDescription& robot() const { return configuration.robot_at(robot_index); }
  /// Name on the bus of the robot's channel; `canonical`: one of which each robot has its own.
  const std::string& channel(std::string_view canonical, std::size_t sensor = 0) const {
    return configuration.channels.robots_bus(canonical, robot_index, sensor);
  }
  /// The same for another robot.
  TickContext of_robot(std::size_t index) const {
    return {configuration, now, outputs, listeners, tally, index};
  }
};

/// Publishes an event on MR_EVENTS. Scripts and the grader receive it too.
void publish_event(const TickContext& context, const Event& event);

/// What two texts of one kind have in common.
std::string without_numbers(std::string_view text);

/// Counts a message that could not be decoded or is not allowed.
void refuse(const TickContext& context, const Error& error);

}  // namespace parhelion::tick
