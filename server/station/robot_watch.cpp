#include "server/station/robot_watch.hpp"

#include <algorithm>
#include <set>

#include "protocols/channels.hpp"
#include "server/runtime/knowledge.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/tick/instructor_input.hpp"

namespace parhelion::station {
namespace {

constexpr Duration kPoll = milliseconds(20);  // the teleop service is updated every 50 ms
constexpr int kMaxEvents = 16'384;  // a crowd that is removed displaces no reply to an emergency stop
constexpr Duration kWorldPeriod = milliseconds(250);

const simulation::RobotModel* model_of(const DrivenRobot& robot, const tick::Configuration& configuration,
                                       const AgentDefinition* placed) {
  const Scenario& scenario = configuration.scenario;
  std::string name;
  if (placed != nullptr) name = placed->model;
  if (const auto index = configuration.find_robot(robot.name)) name = configuration.robot_at(*index).model;
  if (scenario.trainee && scenario.trainee->name == robot.name) name = scenario.trainee->model;
  const auto& models = configuration.robot_models;
  const auto found =
      std::find_if(models.begin(), models.end(), [&](const auto& each) { return each->name == name; });
  return found == models.end() ? nullptr : found->get();
}

const char* word(simulation::JointKind kind) {
  return kind == simulation::JointKind::prismatic    ? "prismatic"
         : kind == simulation::JointKind::continuous ? "continuous"
                                                     : "revolute";
}

}  // namespace

TeleopRobot drivable(const DrivenRobot& robot, const tick::Configuration& configuration,
                     const AgentDefinition* placed) {
  TeleopRobot made;
  made.driven = robot;
  const auto index = configuration.find_robot(robot.name);
  if (index) {
    made.driven.teleop = configuration.channels.robots_bus(channel::kTeleop, *index);
    made.driven.joints = configuration.channels.robots_bus(channel::kJointCmd, *index);
  }
  const simulation::RobotModel* model = model_of(robot, configuration, placed);
  if (index || model != nullptr) {
    const RobotLimits& limits = index ? configuration.robot_at(*index).limits : model->description.limits;
    made.vx = limits.speed;
    made.wz = limits.yaw_rate;
  }
  made.video = index
                   ? configuration.robot_at(*index).camera || !tick::simulates_trainee(configuration.scenario)
                   : placed != nullptr && placed->camera_rate > 0;
  if (model == nullptr || made.driven.joints.empty()) return made;
  for (const simulation::RobotJoint& joint : model->joints) {
    const bool wheel =
        std::any_of(model->drive.runners.begin(), model->drive.runners.end(), [&](const auto& runner) {
          return (runner.kind == simulation::RobotRunner::Kind::wheel && runner.link == joint.child) ||
                 (runner.steering && model->joints[*runner.steering].name == joint.name);
        });
    if (joint.kind == simulation::JointKind::fixed || joint.geared || wheel) continue;
    made.joints.push_back({joint.name, word(joint.kind), joint.lower, joint.upper, joint.velocity});
  }
  return made;
}

RobotWatch::RobotWatch(std::unique_ptr<Bus> bus, std::shared_ptr<const tick::Configuration> configuration,
                       VideoFeed& video, TeleopService* teleop, std::string trainee_why_not)
    : bus_(std::move(bus)),
      configuration_(std::move(configuration)),
      video_(video),
      teleop_(teleop),
      trainee_why_not_(std::move(trainee_why_not)),
      placed_(configuration_->scenario) {}

Status RobotWatch::start() {
  const tick::ChannelMap& channels = configuration_->channels;
  std::vector<std::pair<std::string, int>> wanted{{channels.bus(channel::kMrWorld), 1},
                                                  {channels.bus(channel::kOperators), 64},
                                                  {channels.bus(channel::kMrEvents), kMaxEvents}};
  for (std::string& name : tick::command_channels(channels)) wanted.emplace_back(std::move(name), 256);
  for (const auto& [name, capacity] : wanted) {
    if (Status subscribed = bus_->subscribe(name, capacity); !subscribed) return subscribed;
  }
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  return {};
}

void RobotWatch::run(const std::stop_token& stop) {
  Message message;
  WallTime turned;
  while (!stop.stop_requested()) {
    const auto received = bus_->receive(message, kPoll);
    if (!received) return;  // the station reports it
    if (*received) take(message);
    if (runtime::steady_now() - turned < kPoll) continue;
    turned = runtime::steady_now();
    if (teleop_ != nullptr) teleop_->turn();
  }
}

void RobotWatch::take(const Message& message) {
  const tick::ChannelMap& channels = configuration_->channels;
  OperatorStatus operator_status;
  Event event;
  InstructorCommand command;
  if (message.channel == channels.bus(channel::kMrWorld)) return handle_world(message);
  if (tick::is_command(channels.kind(message.channel)) &&
      tick::read_command(channels, message, command).ok()) {
    placed_.take(command);
    const auto* stop = std::get_if<EmergencyStopCommand>(&command);
    if (teleop_ != nullptr && stop != nullptr) teleop_->handle(*stop);
  }
  if (message.channel == channels.bus(channel::kOperators) && teleop_ != nullptr &&
      decode(message.channel, message.payload, operator_status).ok())
    teleop_->handle(operator_status);
  if (message.channel == channels.bus(channel::kMrEvents) &&
      decode(message.channel, message.payload, event).ok()) {
    placed_.take(event);
    if (event.kind == EventKind::command_accepted) names_.clear();  // report the changes again
    if (faults_.handle(event)) video_.impair(faults_.delay(), faults_.loss());
    if (teleop_ != nullptr) teleop_->handle(event);
  }
}

void RobotWatch::handle_world(const Message& message) {
  const WallTime now = runtime::steady_now();
  WorldMessage world;
  if (now < world_due_ || !decode(message.channel, message.payload, world)) return;
  world_due_ = now + kWorldPeriod;
  const std::vector<DrivenRobot> robots = robots_in(world);
  std::vector<std::string> names;
  for (const DrivenRobot& robot : robots) names.push_back(robot.name);
  if (names == names_) return;
  names_ = names;
  const auto is_trainees = [&](const std::string& name) {
    const AgentDefinition* placed = placed_.find(name);
    return configuration_->find_robot(name) ||
           (placed != nullptr && runtime::is_driven_by_trainees(*configuration_, *placed));
  };
  std::set<std::string> for_trainees;
  for (const std::string& name : names)
    if (is_trainees(name)) for_trainees.insert(name);
  video_.set_robots(std::move(names), for_trainees);
  if (teleop_ == nullptr) return;
  std::vector<TeleopRobot> drivables;
  for (const DrivenRobot& robot : robots) {
    drivables.push_back(drivable(robot, *configuration_, placed_.find(robot.name)));
    drivables.back().for_trainees = for_trainees.contains(robot.name);
    if (configuration_->find_robot(robot.name)) drivables.back().why_not = trainee_why_not_;
  }
  teleop_->set_robots(std::move(drivables));
}

}  // namespace parhelion::station
