#include "tests/loop/lift.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "examples/robot/arm_task.hpp"
#include "fusion/scan/augment.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/runtime/thread_pool.hpp"
#include "server/simulation/bodies/handling.hpp"
#include "server/simulation/bodies/real_grip.hpp"
#include "server/tick/tick.hpp"
#include "tests/loop/site.hpp"

namespace parhelion::test {
namespace {

constexpr std::int64_t kBegin = 1'700'000'000'000'000;  // us
constexpr std::int64_t kTick = 10'000;                  // us
// s: events are this much late or early at most. Encoders speak each 50 ms, and between their messages the
// arm is taken to go on.
constexpr double kLate = 0.08, kEarly = 0.08;
constexpr double kRocks = 6;     // s that it may rock in the container until it rests
constexpr double kLongest = 60;  // s
constexpr double kRim = 0.03;    // m, of the container, and what its place in MR_WORLD may be off

using Payloads = std::map<std::string, std::vector<std::vector<std::uint8_t>>>;

/// What is to be lifted, and where everything is.
struct LiftSetup {
  Pose2 base;
  Eigen::Vector2d thing, container;  // base_link
  double width = 0, height = 0, mass = 0;
  bool round = false;
  double thing_yaw = 0, container_yaw = 0;  // rad, base_link
  Eigen::Vector3d container_size;
};

Eigen::Vector2d polar(double range, double angle) {
  return {range * std::cos(angle), range * std::sin(angle)};
}

LiftSetup draw_setup(std::uint64_t seed) {
  Draw draw(seed * 7919 + 3);
  LiftSetup setup;
  setup.base = {draw.within(-2, 2), draw.within(-2, 2), draw.within(-3, 3)};
  const double at = draw.within(-0.6, 0.6), apart = draw.within(1.2, 1.8);
  setup.thing = polar(draw.within(0.54, 0.62), at);
  setup.container = polar(draw.within(0.54, 0.60), at + (draw.chance(0.5) ? apart : -apart));
  setup.round = draw.chance(0.4);
  setup.width = draw.within(0.04, 0.085);
  setup.height = draw.within(0.42, 0.50);
  setup.mass = draw.within(0.2, 1.9);
  setup.thing_yaw = at + draw.within(-0.06, 0.06);
  setup.container_yaw = draw.within(-3, 3);
  setup.container_size = {draw.within(0.40, 0.45), draw.within(0.40, 0.45), draw.within(0.28, 0.31)};
  return setup;
}

Transform<Map, Base> in_map(const LiftSetup& setup, const Eigen::Vector2d& p, double yaw) {
  return Transform<Map, Base>::planar(setup.base.x, setup.base.y, setup.base.yaw) *
         Transform<Base, Base>::planar(p.x(), p.y(), yaw);
}

AgentDefinition thing_of(const LiftSetup& setup) {
  AgentDefinition thing;
  thing.name = "part_1";
  thing.kind = setup.round ? AgentKind::barrel : AgentKind::box;
  thing.size = {setup.width, setup.width, setup.height};
  thing.mass = setup.mass;
  thing.T_map_base = in_map(setup, setup.thing, setup.thing_yaw);
  return thing;
}

AgentDefinition container_of(const LiftSetup& setup) {
  AgentDefinition container;
  container.name = "container_1";
  container.kind = AgentKind::container;
  container.size = setup.container_size;
  container.T_map_base = in_map(setup, setup.container, setup.container_yaw);
  return container;
}

Task task(const std::string& name, double points, EventKind event, const std::string& object) {
  Task made;
  made.name = name, made.points = points;
  made.done.kind = Condition::Kind::event;
  made.done.event = event, made.done.object = object;
  return made;
}

/// The tasks of server/scenarios/programmes/lift_and_place.yaml.
Training training(const std::string& robot) {
  Training training;
  training.robot = robot;
  training.on_command = false;
  training.text = "Lift the part and put it into the container.";
  training.pass_mark = 0.6;
  training.tasks = {task("grip", 20, EventKind::gripped, "part_1"),
                    task("lift", 20, EventKind::lifted, "part_1"),
                    task("into the container", 60, EventKind::placed, "container_1")};
  Penalty dropped;
  dropped.name = "dropped it", dropped.points = 20;
  dropped.when.event = EventKind::dropped;
  training.penalties = {dropped};
  return training;
}

ModelEntity wall(const std::string& name, const Eigen::Vector2d& at, const Eigen::Vector2d& size) {
  ModelEntity entity;
  entity.name = name, entity.label = EntityLabel::wall;
  entity.T_map_body = Transform<Map, Body>::planar(at.x(), at.y(), 0, 1.25);
  entity.size = {size.x(), size.y(), 2.5};
  return entity;
}

SemanticModel hall() {
  SemanticModel model;
  model.map_id = "hall";
  model.entities = {wall("wall 1", {0, -5}, {10, 0.1}), wall("wall 2", {0, 5}, {10, 0.1}),
                    wall("wall 3", {-5, 0}, {0.1, 10}), wall("wall 4", {5, 0}, {0.1, 10})};
  return model;
}

tick::Configuration configuration_of(std::uint64_t seed, LiftBy by) {
  const LiftSetup setup = draw_setup(seed);
  const std::string folder = std::string(PARHELION_SOURCE_DIR) + "/examples/robot/";
  auto model = simulation::load_robot_model(folder + "body.yaml");
  auto description = load_robot_description(folder + "robot.yaml");
  if (!model || !description)
    throw std::runtime_error(model ? description.error().message : model.error().message);
  description->model = model->name;
  Scenario scenario;
  scenario.name = "lift and place";
  scenario.seed = seed + 1;
  scenario.agents = {thing_of(setup), container_of(setup)};
  if (by == LiftBy::robot) {
    AgentDefinition driven;
    driven.name = "robot_1", driven.kind = AgentKind::robot, driven.laser = "utm-30lx";
    driven.behaviour.kind = BehaviourKind::teleop;
    driven.T_map_base = Transform<Map, Base>::planar(setup.base.x > 0 ? -4 : 4, 3.5, 0);
    scenario.agents.push_back(driven);
  }
  scenario.training = training(description->name);
  auto made = tick::configure_robots(scenario, {*description}, hall(),
                                     {std::make_shared<const simulation::RobotModel>(std::move(*model))});
  if (!made) throw std::runtime_error(made.error().message);
  return std::move(*made);
}

/// m over the floor, of the point between the pads.
double pads_of(const ::robot::ArmPosture& arm) {
  const double upper = arm.shoulder, fore = upper + arm.elbow, hand = fore + arm.wrist;
  return ::robot::kShoulderHeight + ::robot::kUpperArm * std::sin(upper) +
         ::robot::kForearm * std::sin(fore) + ::robot::kHand * std::sin(hand);
}

class Lift {
 public:
  Lift(std::uint64_t seed, LiftBy by, int threads)
      : by_(by), setup_(draw_setup(seed)), configuration_(configuration_of(seed, by)) {
    auto made = tick::make_state(configuration_, ArrivalTime::from_utime(kBegin - 2000),
                                 std::make_unique<runtime::ThreadPool>(threads));
    if (!made) throw std::runtime_error(made.error().message);
    state_ = std::move(*made);
    grader_.emplace(*configuration_.scenario.training, configuration_.model, configuration_.robot,
                    configuration_.robot.name, state_->simulation.now());
  }

  LiftReport run() {
    double rest = 0;
    for (; t() < kLongest && rest < 4; now_ += kTick) {
      step();
      watch();
      if (task_ && task_->is_done()) rest += 1e-6 * kTick;
    }
    if (!task_) throw std::runtime_error("MR_WORLD shows neither part nor container");
    report_.phase = task_->phase();
    char text[160];
    std::snprintf(text, sizeof text, "%s of %.0f mm, %.2f m, %.1f kg at %.2f m",
                  setup_.round ? "barrel" : "box", 1e3 * setup_.width, setup_.height, setup_.mass,
                  setup_.thing.norm());
    report_.thing = text;
    report_.live = state_->grading->graders.front().grade();
    report_.from_log = grader_->grade();
    check();
    return std::move(report_);
  }

  Payloads feed_all(const std::vector<Message>& inputs) {
    for (const Message& input : inputs) feed(input);
    return std::move(report_.outputs);
  }

 private:
  double t() const { return 1e-6 * static_cast<double>(now_ - kBegin); }

  void add(const char* channel, std::int64_t arrival, const auto& item) {
    Message message{channel, ArrivalTime::from_utime(arrival), {}};
    encode(item, message.payload);
    pending_.push_back(std::move(message));
  }

  void step() {
    arm_.step(1e-6 * kTick, now_);
    const auto n = (now_ - kBegin) / kTick;
    const auto T_map_base = in_map(setup_, {0, 0}, 0);
    if (n % 5 == 0) {
      add(channel::kOdometry, now_ + 2000,
          Odometry{SensorTime::from_utime(now_), T_map_base.as<Odom, Base>()});
      send_joints();
      command();
    }
    if (n % 10 == 0) {
      add(channel::kScan, now_ + 6000, scan());
      PoseEstimate pose;
      pose.stamp = SensorTime::from_utime(now_);
      pose.T_map_base = T_map_base;
      pose.covariance = PoseCovariance::Identity() * 1e-5;
      pose.map_id = "hall";
      pose.state = SlamState::tracking;
      add(channel::kPoseCov, now_ + 25'000, pose);
    }
    deliver(now_ + kTick);
  }

  void send_joints() {
    const auto encoders = arm_.state(now_);
    Message message{channel::kJointState, ArrivalTime::from_utime(now_ + 2500), {}};
    message.payload.resize(static_cast<std::size_t>(encoders.getEncodedSize()));
    encoders.encode(message.payload.data(), 0, static_cast<int>(message.payload.size()));
    pending_.push_back(std::move(message));
  }

  /// Where MR_WORLD shows the things: the server moves what would appear too near to the robot.
  void make_task() {
    const auto part = seen_.find("part_1"), container = seen_.find("container_1");
    if (part == seen_.end() || container == seen_.end()) return;
    ::robot::ArmTask::Plan plan;
    plan.thing = {part->second.x(), part->second.y()};
    plan.container = {container->second.x(), container->second.y()};
    plan.thing_height = setup_.height;
    plan.container_room = setup_.container_size.head<2>().minCoeff() / 2 - kRim - setup_.width / std::sqrt(2);
    plan.closed = by_ == LiftBy::robot ? setup_.width / 2 - 0.001 : 0;
    task_.emplace(plan);
    container_ = container->second;
  }

  /// From the encoders, as the script knows no other posture.
  void command() {
    if (n_commands_++ < 20) return;  // a second, in which the robot becomes known
    if (!task_) make_task();
    if (!task_) return;
    const auto read = arm_.state(now_).positions;
    const ::robot::ArmPosture encoders{read[0], read[1], read[2], read[3], read[4]};
    if (const auto target = task_->command(encoders, 0.05)) target_ = target;
    if (!target_) return;
    Joints joints;
    joints.stamp = SensorTime::from_utime(now_);
    joints.names = {"turret", "shoulder", "elbow", "wrist", "gripper"};
    joints.positions = {target_->turret, target_->shoulder, target_->elbow, target_->wrist, target_->gripper};
    if (by_ == LiftBy::trainee) {
      add(channel::kJointCmd, now_ + 3000, joints);
    } else {
      process_command(joints);
      add("MR_AGENT_robot_1_TELEOP", now_ + 3000,
          TwistCommand{SensorTime::from_utime(now_), {0.3, 0, std::sin(t() / 3)}});
    }
  }

  void process_command(const Joints& joints) {
    parhelion::joints_t command{};
    command.utime = joints.stamp.utime();
    command.names = joints.names, command.positions = joints.positions,
    command.velocities = joints.velocities;
    command.njoints = static_cast<std::int32_t>(joints.names.size());
    command.npositions = static_cast<std::int32_t>(joints.positions.size());
    command.nvelocities = static_cast<std::int32_t>(joints.velocities.size());
    arm_.receive(command, now_);
  }

  Scan scan() {
    const LaserDescription& laser = *configuration_.robot.laser;
    Scan scan;
    scan.stamp = SensorTime::from_utime(now_);
    constexpr int beams = 360;
    scan.angle_min = -static_cast<float>(std::numbers::pi);
    scan.angle_increment = static_cast<float>(2 * std::numbers::pi / beams);
    const std::vector<float> time(beams, 0.0F);
    std::vector<scan::RangeHit> hits(beams);
    const auto T_map_laser = in_map(setup_, {0, 0}, 0) * laser.T_base_laser;
    scan::cast_building_exact({T_map_laser, T_map_laser}, {scan.angle_min, scan.angle_increment, time},
                              configuration_.model, 25, hits);
    for (const scan::RangeHit& hit : hits)
      scan.ranges.push_back(std::isinf(hit.range) ? laser.convention.no_return_sentinel() : hit.range);
    return scan;
  }

  void deliver(std::int64_t until) {
    std::stable_sort(pending_.begin(), pending_.end(),
                     [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
    std::size_t n = 0;
    for (; n < pending_.size() && pending_[n].arrival.utime() <= until; ++n) {
      feed(pending_[n]);
      report_.inputs.push_back(pending_[n]);
    }
    pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(n));
  }

  void feed(const Message& input) {
    outputs_.clear();
    tick::tick(configuration_, input, *state_, outputs_, stages_);
    for (const tick::Outputs::Entry& entry : outputs_.entries()) {
      handle(entry);
      report_.outputs[entry.channel].push_back(entry.payload);
    }
  }

  void handle(const tick::Outputs::Entry& entry) {
    if (entry.channel == channel::kMrJointCmd) {
      Joints joints;
      if (decode(entry.channel, entry.payload, joints)) process_command(joints);
    } else if (entry.channel == channel::kMrEvents) {
      handle_event(entry);
    } else if (entry.channel == channel::kMrWorld) {
      WorldMessage world;
      if (!decode(entry.channel, entry.payload, world)) return;
      grader_->take(world);
      const auto T_base_map = in_map(setup_, {0, 0}, 0).inverse();
      for (const WorldMessage::Entry& body : world.bodies)
        seen_[body.entity] = (T_base_map * body.T_map_body.translation()).head<2>();
    } else if (entry.channel == channel::kMrScanInfo && !lifted_) {
      ScanInfo info;
      if (!decode(entry.channel, entry.payload, info)) return;
      const auto part = std::find(info.agents.begin(), info.agents.end(), "part_1");
      const auto index = part - info.agents.begin();
      for (const auto agent : info.beam_agent)
        report_.beams_of_thing += part != info.agents.end() && agent == index;
    }
  }

  void handle_event(const tick::Outputs::Entry& entry) {
    Event event;
    if (!decode(entry.channel, entry.payload, event)) return;
    grader_->take(event);
    switch (event.kind) {
      case EventKind::gripped:
      case EventKind::lifted:
      case EventKind::dropped:
      case EventKind::placed:
      case EventKind::payload_exceeded:
      case EventKind::joint_overload:
      case EventKind::encoders_lost:
        report_.events.push_back(event);
        break;
      default:
        break;
    }
  }

  /// When it truly happened, by the arm itself and not by its encoders.
  void watch() {
    const ::robot::ArmPosture arm = arm_.posture();
    if (!task_) return;
    const bool closes = task_->phase() == "closes";
    if (!gripped_ && closes && 2 * arm.gripper <= setup_.width + simulation::RealGrip::kTouch) {
      gripped_ = t();
      pads_ = pads_of(arm);
    }
    if (gripped_ && !lifted_ && pads_of(arm) > pads_ + simulation::GripperWatch::kLift) lifted_ = t();
    if (lifted_ && !opened_ && task_->phase() == "opens" && 2 * arm.gripper > setup_.width) opened_ = t();
  }

  void expect(EventKind kind, const std::optional<double>& truth, double late) {
    int n = 0;
    for (const Event& event : report_.events) {
      if (event.kind != kind) continue;
      ++n;
      const double at = (event.stamp - SimulationTime::from_utime(kBegin)).seconds();
      const double delay = truth ? at - *truth : 1e9;
      if (late < 1) report_.worst_delay = std::max(report_.worst_delay, std::abs(delay));
      if (delay < -kEarly || delay > late)
        report_.failures.push_back(std::string(to_string(kind)) + " " + std::to_string(delay) + " s late");
    }
    if (n != 1) report_.failures.push_back(std::to_string(n) + " events " + to_string(kind));
  }

  void check() {
    if (!task_->is_done()) report_.failures.push_back("the script is not done: " + task_->phase());
    expect(EventKind::gripped, gripped_, kLate);
    expect(EventKind::lifted, lifted_, kLate);
    expect(EventKind::placed, opened_, kRocks);
    for (const Event& event : report_.events)
      if (event.kind != EventKind::gripped && event.kind != EventKind::lifted &&
          event.kind != EventKind::placed)
        report_.failures.push_back(std::string("event ") + to_string(event.kind) + " " + event.object + " " +
                                   event.text);
    const auto part = state_->simulation.pose_of("part_1");
    const Eigen::Vector2d off =
        part->translation().head<2>() - in_map(setup_, container_, 0).translation().head<2>();
    if (off.norm() > 0.32 || part->translation().z() > 0.3)
      report_.failures.emplace_back("it is not in the container");
    if (!report_.live.passed || report_.live.score != 100)
      report_.failures.push_back("score " + std::to_string(report_.live.score));
    if (report_.live.score != report_.from_log.score || report_.live.grade != report_.from_log.grade)
      report_.failures.emplace_back("the log's grade is another");
    if (report_.beams_of_thing < 5) report_.failures.emplace_back("it was not in the scans");
  }

  const LiftBy by_;
  const LiftSetup setup_;
  const tick::Configuration configuration_;
  std::unique_ptr<tick::State> state_;
  tick::Outputs outputs_;
  tick::StageObserver stages_;
  std::optional<training::Grader> grader_;
  ::robot::Arm arm_;
  std::optional<::robot::ArmTask> task_;
  std::optional<::robot::ArmPosture> target_;
  std::vector<Message> pending_;
  std::int64_t now_ = kBegin;
  int n_commands_ = 0;
  std::optional<double> gripped_, lifted_, opened_;  // s
  double pads_ = 0;
  std::map<std::string, Eigen::Vector2d> seen_;  // by entity, base_link
  Eigen::Vector2d container_ = Eigen::Vector2d::Zero();
  LiftReport report_;
};

}  // namespace

LiftReport lift_and_place(std::uint64_t seed, LiftBy by, int threads) {
  return Lift(seed, by, threads).run();
}

Payloads lift_again(std::uint64_t seed, LiftBy by, const LiftReport& report, int threads) {
  return Lift(seed, by, threads).feed_all(report.inputs);
}

}  // namespace parhelion::test
