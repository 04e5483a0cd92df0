#include "server/tick/start_path.hpp"

#include <algorithm>
#include <cmath>

#include "protocols/codec.hpp"
#include "protocols/joints.hpp"

namespace parhelion::tick {
namespace {

constexpr double kMovingSpeed = 0.05;    // m/s of a real robot: above what a standing one's odometry shows
constexpr double kMovingYawRate = 0.15;  // rad/s

bool is_motion(const TwistCommand& command) {
  return command.twist.vx != 0 || command.twist.vy != 0 || command.twist.wz != 0;
}

bool is_motion(const Joints& command) {
  const auto any = [](const std::vector<double>& values) {
    return std::any_of(values.begin(), values.end(), [](double value) { return value != 0; });
  };
  return !command.positions.empty() || any(command.velocities) || any(command.efforts);
}

template <class Command>
bool commands_motion(const Message& input) {
  Command command;
  return decode(input.channel, input.payload, command).ok() && is_motion(command);
}

bool is_graded(const Configuration& configuration, const std::string& robot) {
  const std::vector<std::string> graded = graded_robots(configuration);
  return std::find(graded.begin(), graded.end(), robot) != graded.end();
}

bool moves(const simulation::RealRobotState& robot) {
  return std::hypot(robot.twist.vx, robot.twist.vy) > kMovingSpeed ||
         std::abs(robot.twist.wz) > kMovingYawRate;
}

}  // namespace

bool waits_for_start(const Scenario& scenario) { return scenario.training && scenario.training->on_command; }

void start_training(const TickContext& context, const std::string& by, const StartPath& path) {
  if (!path.waiting) return;
  path.waiting = false;
  path.simulation.begin();
  path.scripts.begin(context.now);
  path.faults.started = context.now;
  Event event;
  event.stamp = context.now;
  event.kind = EventKind::training_started;
  event.subject = by;
  publish_event(context, event);
}

void start_on_command(const TickContext& context, InputKind kind, const std::string& robot,
                      const Message& input, const StartPath& path) {
  if (!path.waiting || !is_graded(context.configuration, robot)) return;
  const bool joints = kind == InputKind::joint_command || kind == InputKind::agent_joint_command;
  const bool motion = joints ? commands_motion<Joints>(input) : commands_motion<TwistCommand>(input);
  if (motion) start_training(context, robot, path);
}

void watch_start(const TickContext& context, const RealRobots& robots, const StartPath& path) {
  if (!path.waiting) return;
  path.faults.started = context.now;
  if (simulates_trainee(context.configuration.scenario)) return;
  for (const std::string& graded : graded_robots(context.configuration)) {
    const auto index = context.configuration.find_robot(graded);
    if (index && robots[*index] && moves(*robots[*index])) return start_training(context, graded, path);
  }
}

}  // namespace parhelion::tick
