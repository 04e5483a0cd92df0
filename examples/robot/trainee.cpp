// Replaces a trainee at a console: drives a robot along points of the map by TELEOP. It knows obstacles only
// from the robot's scans, and the robot's pose from the plan, as a trainee does on the page.
//
//   example_trainee --to 4,2.5 --to 8,2.5                  the real robot, on MR_SCAN
//   example_trainee --agent robot_1 --to 2,1               a virtual robot with `behaviour: {kind: teleop}`
//   and a laser
//   example_trainee --lift 4.6,2.5,0.45 --into 4,3.1       the real robot's arm, which stands before the
//   thing
//
// Exit code 0: at the last point, or the thing is in the container. 3, with the reason: not reached in time.
#include <chrono>
#include <csignal>
#include <cstdio>
#include <lcm/lcm-cpp.hpp>
#include <optional>
#include <vector>

#include "arguments.hpp"
#include "arm_task.hpp"
#include "description.hpp"
#include "laser.hpp"
#include "obstacles.hpp"
#include "parhelion/joints_t.hpp"
#include "parhelion/operator_t.hpp"
#include "parhelion/pose_cov_t.hpp"
#include "parhelion/twist2D_t.hpp"
#include "parhelion/world_t.hpp"
#include "route.hpp"

namespace {

using robot::Pose2;

constexpr const char* kHelp =
    "usage: example_trainee --to X,Y [--to X,Y]... [OPTION VALUE]...\n"
    "  --to X,Y          m in the map: a point to drive to; given again: the next one\n"
    "  --agent NAME      drives this virtual robot; without it the real one\n"
    "  --robot NAME      name of the real robot (example_robot)\n"
    "  --speed M_PER_S   on a free path (0.5)\n"
    "  --patience S      then it gives up (60)\n"
    "  --careless yes    does not look at the scans\n"
    "  --shoulder RAD    brings this joint of the real robot's arm there, and holds it\n"
    "  --lift X,Y,HEIGHT m in the map: after the last point the arm lifts the thing that stands there\n"
    "  --into X,Y        m in the map: centre of the container\n";

// Outline and laser of the server's virtual robots that have no model of their own.
const robot::Polygon kAgentFootprint = {{-0.3, -0.24}, {0.3, -0.24}, {0.3, 0.24}, {-0.3, 0.24}};
constexpr Pose2 kAgentLaserPose{0.2, 0, 0};

constexpr std::int64_t kPeriod = 50'000;    // us between two commands: 20 a second
constexpr std::int64_t kSilence = 400'000;  // us without a scan or a pose: it lets go
constexpr int kHeartbeat = 8;               // commands between two messages on OPERATOR
constexpr int kArmPeriod = 2;               // commands between two of the arm

struct Options {
  std::string agent, robot = "example_robot";
  double speed = 0.5, patience = 60;
  bool careless = false;
  std::optional<double> shoulder;  // rad
  std::optional<robot::Point2> lift, into;
  double height = 0;  // m, of what is lifted
  std::vector<robot::Point2> points;
};

volatile std::sig_atomic_t end = 0;

void request_end(int) { end = 1; }

std::int64_t now_us() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

double yaw_of(const double (&quaternion)[4]) {
  const double w = quaternion[0], x = quaternion[1], y = quaternion[2], z = quaternion[3];
  return std::atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
}

class Trainee {
 public:
  Trainee(lcm::LCM& bus, const Options& options)
      : bus_(bus), options_(options), route_(settings(options), options.points) {
    const bool of_agent = !options.agent.empty();
    teleop_ = of_agent ? "MR_AGENT_" + options.agent + "_TELEOP" : "TELEOP";
    T_base_laser_ = of_agent ? kAgentLaserPose : robot::kLaserPose;
    bus_.subscribe(of_agent ? "MR_AGENT_" + options.agent + "_SCAN" : "MR_SCAN", &Trainee::handle_scan, this);
    if (of_agent)
      bus_.subscribe("MR_WORLD", &Trainee::handle_world, this);
    else
      bus_.subscribe("POSE_COV", &Trainee::handle_pose, this);
    if (options.lift) bus_.subscribe("JOINT_STATE", &Trainee::handle_joints, this);
  }

  // Whether it has reached its last point.
  bool drive() {
    const std::int64_t begin = now_us();
    std::int64_t next = begin;
    for (int n = 0; !end && !route_.is_reached() && next - begin < 1e6 * options_.patience; ++n) {
      for (std::int64_t left = next - now_us(); left > 0; left = next - now_us())
        bus_.handleTimeout(static_cast<int>((left + 999) / 1000));
      if (n % kHeartbeat == 0) publish_operator(0);
      if (n % kArmPeriod == 0 && options_.shoulder) publish_arm();
      publish(now_us() - steered_ > kSilence ? robot::Twist2{} : command_);
      next += kPeriod;
    }
    publish({});
    publish_operator(1);
    return route_.is_reached();
  }
  // Whether the thing has been lifted and released over the container. The robot stands still.
  bool lift() {
    constexpr double kDt = 1e-6 * kPeriod;
    std::optional<robot::ArmTask> task;
    std::int64_t next = now_us();
    const std::int64_t begin = next;
    for (int n = 0; !end && next - begin < 1e6 * options_.patience; ++n, next += kPeriod) {
      for (std::int64_t left = next - now_us(); left > 0; left = next - now_us())
        bus_.handleTimeout(static_cast<int>((left + 999) / 1000));
      if (n % kHeartbeat == 0) publish_operator(0);
      if (!encoders_ || poses_ == 0) continue;
      if (!task) task.emplace(plan());
      const auto target = task->command(*encoders_, kDt);
      doing_ = task->phase();
      if (!target) break;
      publish_posture(*target);
    }
    publish_operator(1);
    return task && task->is_done();
  }
  std::string reason() const {
    if (!doing_.empty()) return "the arm " + doing_;
    if (steered_ == 0) return poses_ == 0 ? "no pose" : "no scan";
    return *route_.reason() != 0 ? route_.reason() : "out of time";
  }

 private:
  static robot::Route::Settings settings(const Options& options) {
    robot::Route::Settings settings;
    settings.footprint = options.agent.empty() ? robot::kFootprint : kAgentFootprint;
    settings.speed = options.speed;
    return settings;
  }
  void handle_scan(const lcm::ReceiveBuffer*, const std::string&, const parhelion::planar_lidar_t* scan) {
    scan_ = *scan;
    steer();
  }
  void handle_pose(const lcm::ReceiveBuffer*, const std::string&, const parhelion::pose_cov_t* pose) {
    constexpr int kTracking = 1;
    if (pose->state == kTracking) take(pose->utime, {pose->pos[0], pose->pos[1], yaw_of(pose->orientation)});
  }
  void handle_world(const lcm::ReceiveBuffer*, const std::string&, const parhelion::world_t* world) {
    for (const parhelion::body_state_t& body : world->bodies) {
      if (body.entity == options_.agent && body.part == "chassis")
        take(world->utime, {body.pos[0], body.pos[1], yaw_of(body.orientation)});
    }
  }
  void take(std::int64_t utime, const Pose2& T_map_base) {
    if (utime <= posed_) return;  // repeated, or out of order
    posed_ = utime;
    ++poses_;
    track_.add(utime, T_map_base);
    steer();
  }
  // Scan and pose arrive one after the other, in either order. When both of one instant are there, computes a
  // new command.
  void steer() {
    if (scan_.ranges.empty() || posed_ < scan_.utime) return;
    const Pose2 T_map_base = track_.at(scan_.utime);
    std::vector<robot::Point2> seen = robot::points_of(scan_, T_base_laser_, robot::kRangeMax);
    for (robot::Point2& p : seen) p = T_map_base * p;
    if (options_.careless) seen.clear();
    command_ = route_.drive(T_map_base, command_, seen);
    steered_ = now_us();
    scan_.ranges.clear();
  }
  void publish(const robot::Twist2& twist) {
    parhelion::twist2D_t message{};
    message.utime = now_us();
    message.vx = static_cast<float>(twist.vx);
    message.wz = static_cast<float>(twist.wz);
    bus_.publish(teleop_, &message);
  }
  void publish_arm() {
    parhelion::joints_t message{};
    message.utime = now_us();
    message.names = {"shoulder"};
    message.positions = {*options_.shoulder};
    message.njoints = message.npositions = 1;
    bus_.publish("JOINT_CMD", &message);
  }
  void handle_joints(const lcm::ReceiveBuffer*, const std::string&, const parhelion::joints_t* joints) {
    robot::ArmPosture read;
    int known = 0;
    for (std::size_t i = 0; i < joints->names.size() && i < joints->positions.size(); ++i) {
      for (const auto& [name, position] : named(read)) {
        if (name != joints->names[i]) continue;
        *position = joints->positions[i];
        ++known;
      }
    }
    if (known == 5) encoders_ = read;
  }
  static std::vector<std::pair<std::string, double*>> named(robot::ArmPosture& arm) {
    return {{"turret", &arm.turret},
            {"shoulder", &arm.shoulder},
            {"elbow", &arm.elbow},
            {"wrist", &arm.wrist},
            {"gripper", &arm.gripper}};
  }
  robot::ArmTask::Plan plan() const {
    const Pose2 T_base_map = inverse(track_.at(posed_));
    robot::ArmTask::Plan plan;
    plan.thing = T_base_map * *options_.lift;
    plan.container = T_base_map * *options_.into;
    plan.thing_height = options_.height;
    return plan;
  }
  void publish_posture(robot::ArmPosture posture) {
    parhelion::joints_t message{};
    message.utime = now_us();
    for (const auto& [name, position] : named(posture)) {
      message.names.push_back(name);
      message.positions.push_back(*position);
    }
    message.njoints = message.npositions = static_cast<std::int32_t>(message.names.size());
    bus_.publish("JOINT_CMD", &message);
  }
  void publish_operator(std::int8_t state) {
    parhelion::operator_t message{};
    message.utime = now_us();
    message.name = "example_trainee";
    message.robot = options_.agent.empty() ? options_.robot : options_.agent;
    message.state = state;
    message.text = "example_trainee";
    bus_.publish("OPERATOR", &message);
  }

  lcm::LCM& bus_;
  Options options_;
  robot::Route route_;
  std::string teleop_;
  Pose2 T_base_laser_;
  robot::Track track_;
  std::int64_t posed_ = 0, steered_ = 0;
  int poses_ = 0;
  parhelion::planar_lidar_t scan_{};  // the newest without a command yet
  robot::Twist2 command_;
  std::optional<robot::ArmPosture> encoders_;
  std::string doing_;  // of the arm
};

// "X,Y,HEIGHT"
void set_lift(Options& options, const std::string& option, const std::string& value) {
  const auto comma = value.rfind(',');
  if (comma == std::string::npos) throw std::invalid_argument(option + " " + value + ": expected X,Y,HEIGHT");
  options.lift = robot::point(option, value.substr(0, comma));
  options.height = robot::number(option, value.substr(comma + 1));
}

void set(Options& options, const std::string& option, const std::string& value) {
  if (option == "--to")
    options.points.push_back(robot::point(option, value));
  else if (option == "--agent")
    options.agent = value;
  else if (option == "--robot")
    options.robot = value;
  else if (option == "--speed")
    options.speed = robot::number(option, value);
  else if (option == "--patience")
    options.patience = robot::number(option, value);
  else if (option == "--careless")
    options.careless = value == "yes";
  else if (option == "--shoulder")
    options.shoulder = robot::number(option, value);
  else if (option == "--lift")
    set_lift(options, option, value);
  else if (option == "--into")
    options.into = robot::point(option, value);
  else
    throw std::invalid_argument(option + ": no such option");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && std::string(argv[1]) == "--help") return std::fputs(kHelp, stdout) < 0;
  try {
    Options options;
    robot::read_arguments(argc, argv,
                          [&](const auto& option, const auto& value) { set(options, option, value); });
    if (options.points.empty() && !options.lift)
      throw std::invalid_argument("--to: expected at least one point");
    if (options.lift.has_value() != options.into.has_value())
      throw std::invalid_argument("--lift and --into belong together");
    lcm::LCM bus;
    if (!bus.good()) throw std::runtime_error("cannot open LCM; is there a multicast route?");
    std::signal(SIGINT, request_end);
    std::signal(SIGTERM, request_end);
    Trainee trainee(bus, options);
    bool reached = options.points.empty() || trainee.drive();
    if (reached && options.lift) reached = trainee.lift();
    std::printf("%s\n", reached ? "goal reached" : ("not reached: " + trainee.reason()).c_str());
    return reached ? 0 : 3;
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "example_trainee: %s\n%s", error.what(), kHelp);
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "example_trainee: %s\n", error.what());
    return 1;
  }
}
