// Scripted runs of the crawler's arm. The times when an object is gripped, lifted, dropped or placed and when
// a joint breaks are computed beforehand, from commanded joint speeds, the arm's dimensions and free fall;
// the other events, of movement and contact, are derived from the bodies' poses.
#include <map>

#include "scripted_robots.hpp"
#include "tests/degree.hpp"
#include "tests/server/tick/crawler_arm.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

using test::kDegree;
constexpr double kFreeFall = 9.81;
constexpr double kReleaseTime = 0.1, kRest = 0.3, kRestsWithin = 0.006, kLift = 0.02,
                 kSink = 0.5;           // s, s, m, m, m/s: thresholds of gripper events
constexpr double kSpeedUp = 0.2;        // s, for a joint's motor to reach its full speed
constexpr double kPads = 0.08;          // m from the middle of the open gripper to either pad
constexpr double kFinger = 0.006;       // m from a finger's origin to its pad's face
constexpr double kFingerLength = 0.11;  // m
constexpr double kAhead = 0.68;         // m from the turret's axis to the load
constexpr double kTouch = 2e-5;         // m
constexpr double kWall = 0.015;         // m, of a container
const Eigen::Vector3d kHeldLoad(0.08, 0.08, 0.16);

using Values = std::map<std::string, double>;

/// Sent ten times a second starting at `from`, until the next one.
struct Command {
  double from = 0;
  Values positions, speeds = {}, efforts = {};
};

void send_commands(Simulation& simulation, const std::vector<Command>& script, double t) {
  const auto newest = std::find_if(script.rbegin(), script.rend(),
                                   [&](const Command& each) { return each.from <= t + kStep / 2; });
  if (newest == script.rend() || std::lround((t - newest->from) / kStep) % 24 != 0) return;
  const auto send = [&](const Values& values, std::vector<double> Joints::*list) {
    if (values.empty()) return;
    Joints joints;
    for (const auto& [name, value] : values) {
      joints.names.push_back(name);
      (joints.*list).push_back(value);
    }
    const Status status = simulation.joint_command("r", joints);
    ASSERT_TRUE(status.ok()) << status.error().message;
  };
  send(newest->positions, &Joints::positions);
  send(newest->speeds, &Joints::velocities);
  send(newest->efforts, &Joints::efforts);
}

const RobotJoint& joint_of(const RobotModel& model, const std::string& name) {
  return *std::find_if(model.joints.begin(), model.joints.end(),
                       [&](const RobotJoint& each) { return each.name == name; });
}

/// When a joint at rest that is commanded `speed` at `t` has moved by `travel`: it accelerates evenly, and
/// moves with each step's new speed.
double gone(const std::string& name, double t, double speed, double travel) {
  const double acceleration = joint_of(*shipped("crawler"), name).velocity / kSpeedUp;
  return t - kStep + travel / speed + speed / (2 * acceleration) - kStep / 2;
}

/// z over the floor of a point ahead of and above the shoulder, after a rotation upwards by `angle`.
double raised(double ahead, double above, double angle) {
  return kShoulder + ahead * std::sin(angle) + above * std::cos(angle);
}

/// The angle at which f, an increasing function, is `value`.
template <class F>
double solve(const F& f, double value) {
  double low = 0, high = 1;
  for (int i = 0; i < 60; ++i) (f((low + high) / 2) < value ? low : high) = (low + high) / 2;
  return low;
}

/// Expected events of the load, at a step.
class LoadWitness {
 public:
  /// After `released_at` nothing presses on the load: it is placed after resting in the container for a
  /// while.
  explicit LoadWitness(double released_at) : released_at_(released_at) {}
  void see(const Simulation& simulation, double t, std::vector<Expected>& expected) {
    WorldSnapshot world;
    ASSERT_TRUE(simulation.at(simulation.now(), world));
    std::map<std::string, BodyState> at;
    for_each_body(world, [&](const BodyDefinition& body, const BodyState& state) {
      const bool finger = body.part == "left_finger" || body.part == "right_finger";
      if (body.entity != "r")
        at[body.entity] = state;
      else if (finger)
        at[body.part] = state;
    });
    robot_.see(motion(simulation, "r"), t, expected);
    if (!at.contains("load")) return;
    const BodyState& load = at["load"];
    load_.see(load.velocity, load.rotation_rate, t, expected);
    const double between = std::min(gap(load, at["left_finger"], -1), gap(load, at["right_finger"], 1));
    pads_.see(t <= released_at_ && between < kTouch, t, expected);
    if (!at.contains("tub")) return;
    container_.see(at["tub"].velocity, at["tub"].rotation_rate, t, expected);
    double lowest = 1;
    for (const Eigen::Vector3d& corner : corners(load))
      lowest = std::min(lowest, (at["tub"].T_map_body.inverse() * corner).z());
    const Eigen::Vector3d in_container = at["tub"].T_map_body.inverse() * load.T_map_body.translation();
    const bool inside = in_container.head<2>().norm() < 0.15;
    landed_.see(inside && lowest < kWall + kTouch, t, expected);
    if (t <= released_at_ + kReleaseTime) return;
    if (!inside || (in_container - rested_at_).norm() >= kRestsWithin) {
      rested_at_ = in_container;
      still_ = 0;
    }
    still_ += inside ? 1 : 0;
    if (still_ == 1 + std::lround(kRest / kStep)) expected.push_back({EventKind::placed, t, "tub", "r"});
  }

 private:
  static std::vector<Eigen::Vector3d> corners(const BodyState& load) {
    std::vector<Eigen::Vector3d> corners;
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d p(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 1 : 0);
      corners.emplace_back(load.T_map_body * Eigen::Vector3d(p.cwiseProduct(kHeldLoad)));
    }
    return corners;
  }
  /// m between the load and the face of a pad, which points along `travel` times its finger's y axis.
  static double gap(const BodyState& load, const BodyState& finger, double travel) {
    const Eigen::Vector3d center = load.T_map_body * Eigen::Vector3d(0, 0, kHeldLoad.z() / 2);
    const Eigen::Vector3d ahead = finger.T_map_body.inverse() * center;
    double nearest = 1;
    if (std::abs(ahead.z()) > kHeldLoad.x() / 2 || std::abs(ahead.x() - kFingerLength) > kHeldLoad.z() / 2)
      return nearest;
    for (const Eigen::Vector3d& corner : corners(load))
      nearest = std::min(nearest, travel * (finger.T_map_body.inverse() * corner).y());
    return nearest - kFinger;
  }
  double released_at_;
  long still_ = 0;                                              // steps
  Eigen::Vector3d rested_at_ = Eigen::Vector3d::Constant(1e9);  // m, in the container
  MovementWitness robot_, load_{"load"}, container_{"tub"};
  ContactWitness pads_{"r", "load"}, landed_{"load", "tub"};
};

/// The crawler, a load in front of it and a container on its left, within the arm's reach.
Run with_load(const std::string& name, double duration, std::vector<Command> script, double released_at) {
  Run run = with_robot(*shipped("crawler"), floor_of(20), duration);
  run.name = name;
  run.before_step = [script](Simulation& simulation, double t) {
    if (t == kStep) {
      spawn(simulation, articulated("r", "crawler", 0, 0));
      AgentDefinition load = agent("load", AgentKind::box, kTurret + kAhead, 0);
      load.size = kHeldLoad;
      spawn(simulation, load);
      AgentDefinition tub = agent("tub", AgentKind::container, kTurret, kAhead);
      tub.size = {0.4, 0.3, 0.2};
      spawn(simulation, tub);
    }
    send_commands(simulation, script, t);
  };
  const auto witness = std::make_shared<LoadWitness>(released_at);
  run.witness = [=](const Simulation& simulation, double t, std::vector<Expected>& expected) {
    witness->see(simulation, t, expected);
  };
  return run;
}

/// How the load is gripped and lifted: speeds of the fingers and of the shoulder, which rises for `raises` s.
struct Taking {
  double fingers = 0.06, shoulder = 0.25, raises = 0.3;
};

/// Down over the load, gripped from 6 s and lifted from 9 s on.
constexpr double kGrips = 6, kRaises = 9;
std::vector<Command> take(const Taking& taking) {
  const Values close{{"left_finger_joint", taking.fingers}};
  Values raise = close, still = close;
  raise["shoulder_joint"] = taking.shoulder;
  still["shoulder_joint"] = 0;
  return {{0.1, crawler_reach(kAhead, 0.40)},
          {2.5, crawler_reach(kAhead, 0.28)},
          {3.5, crawler_reach(kAhead, 0.19)},
          {4.5, crawler_reach(kAhead, 0.11)},
          {kGrips, {}, close},
          {kRaises, {}, raise},
          {kRaises + taking.raises, {}, still}};
}
std::vector<Expected> taken(const Taking& taking) {
  const double inner = kAhead - kHeldLoad.x() / 2;  // m: its lower edge that rises last
  const double angle = solve([&](double a) { return raised(inner, -kShoulder, a); }, kLift);
  return {{EventKind::gripped, gone("left_finger_joint", kGrips, taking.fingers, kPads - kHeldLoad.y() / 2),
           "load", "r"},
          {EventKind::lifted, gone("shoulder_joint", kRaises, taking.shoulder, angle), "load", "r"}};
}

/// Last contact of fingers that are opened from `opens` on: they separate in that step.
double release_time(double opens) { return opens; }

/// Lifted by less than the threshold of a fall, and released.
Run drops(const Taking& taking) {
  const double opens = 11;
  auto script = take(taking);
  script.push_back({opens, {}, {{"shoulder_joint", 0}}, {{"left_finger_joint", -70}}});
  Run run = with_load("drops", opens + 1.2, script, release_time(opens));
  run.expected = taken(taking);
  run.expected.push_back({EventKind::dropped, release_time(opens) - kStep + kSink / kFreeFall, "load", "r"});
  return run;
}

/// Lifted, moved to the container, and released `above` its bottom; it lands and comes to rest before it
/// counts as released.
Run places(const Taking& taking, double above) {
  const double opens = 20, beside = 90 * kDegree;
  auto script = take(taking);
  const Values hold{{"left_finger_joint", taking.fingers}};
  script.push_back({10, crawler_reach(kAhead, 0.50), hold});
  script.push_back({12, crawler_reach(kAhead, 0.50, beside), hold});
  for (const auto& [at, higher] :
       {std::pair{14.5, 0.25}, {16.0, 0.15}, {17.0, 0.08}, {17.7, 0.04}, {18.4, 0.02}, {19.1, 0.0}})
    script.push_back({at, crawler_reach(kAhead, 0.11 + kWall + above + higher, beside), hold});
  script.push_back({opens, {}, {}, {{"left_finger_joint", -70}}});
  Run run = with_load("places", opens + 0.9, script, release_time(opens));
  run.expected = taken(taking);
  return run;
}

std::size_t index_of(const Joints& joints, const std::string& name) {
  return static_cast<std::size_t>(std::find(joints.names.begin(), joints.names.end(), name) -
                                  joints.names.begin());
}

/// The stretched arm is held at an angle and is then driven with its shoulder's torque. The load, averaged
/// over 20 ms, exceeds the limit in the step after the one computed here.
Run breaks(double angle, double effort, double break_effort) {
  RobotModel model = *shipped("crawler");
  for (RobotJoint& each : model.joints) {
    if (each.name == "shoulder_joint") each.break_effort = break_effort;
  }
  const double drives = 5;
  Run run = with_robot(model, floor_of(20), drives + 3);
  run.name = "breaks";
  const std::vector<Command> script{
      {0.1, {{"shoulder_joint", angle}, {"elbow_joint", 0}, {"wrist_joint", 0}}},
      {drives, {}, {}, {{"shoulder_joint", effort}}}};
  run.before_step = [=](Simulation& simulation, double t) {
    if (t == kStep) spawn(simulation, articulated("r", "crawler", 0, 0));
    send_commands(simulation, script, t);
  };
  const auto moves = std::make_shared<MovementWitness>();
  const auto load = std::make_shared<double>(0);
  const auto broken = std::make_shared<bool>(false);
  run.witness = [=](const Simulation& simulation, double t, std::vector<Expected>& expected) {
    const RobotMotion& now = motion(simulation, "r");
    moves->see(now, t, expected);
    const double torque = std::abs(now.joints.efforts[index_of(now.joints, "shoulder_joint")]);
    *load += (torque - *load) * kStep / 0.02;
    // In the step of the command the motor gives the commanded effort, then the previous one.
    const double next = std::abs(t + kStep - drives) < kStep / 2 ? std::abs(effort) : torque;
    if (*broken || *load + (next - *load) * kStep / 0.02 <= break_effort) return;
    *broken = true;
    expected.push_back({EventKind::joint_broken, t + kStep, "shoulder_joint", "r"});
  };
  return run;
}

/// The shoulder is raised with a motor that is too weak for the stretched arm: it is overloaded after half a
/// second at full torque without motion.
Run overloads_its_shoulder(double effort) {
  RobotModel model = *shipped("crawler");
  for (RobotJoint& each : model.joints) {
    if (each.name != "shoulder_joint") continue;
    each.effort = effort;
    each.break_effort = 0;
  }
  Run run = with_robot(model, floor_of(20), 5);
  run.name = "overload";
  run.before_step = [](Simulation& simulation, double t) {
    if (t != kStep) return;
    spawn(simulation, articulated("r", "crawler", 0, 0));
    joint(simulation, {"elbow_joint"}, 0);
    joint(simulation, {"shoulder_joint"}, 60 * kDegree);
  };
  const auto moves = std::make_shared<MovementWitness>();
  const auto stalled = std::make_shared<double>(0);
  const auto overloaded = std::make_shared<bool>(false);
  const double slow = 0.05 * joint_of(model, "shoulder_joint").velocity;
  run.witness = [=](const Simulation& simulation, double t, std::vector<Expected>& expected) {
    const RobotMotion& now = motion(simulation, "r");
    moves->see(now, t, expected);
    const std::size_t at = index_of(now.joints, "shoulder_joint");
    const double fraction = std::abs(now.joints.efforts[at]) / effort;
    *stalled = fraction >= 0.99 && std::abs(now.joints.velocities[at]) < slow ? *stalled + kStep : 0;
    if (fraction < 0.9) *overloaded = false;
    if (*overloaded || *stalled <= 0.5) return;
    *overloaded = true;
    expected.push_back({EventKind::joint_overload, t, "shoulder_joint", "r"});
  };
  return run;
}

TEST(ScriptedArm, GripsLiftsAndDrops) {
  expect_good({drops({}), drops({0.1, 0.2, 0.35}), drops({0.08, 0.3, 0.25})}, "of what the arm drops");
}

TEST(ScriptedArm, GripsLiftsAndPlacesInAContainer) {
  expect_good({places({}, 0.02), places({0.08, 0.3, 0.25}, 0.02), places({0.1, 0.2, 0.35}, 0.03)},
              "of what the arm places");
}

TEST(ScriptedArm, BreaksAndIsOverloaded) {
  expect_good({breaks(0.3, 110, 40), breaks(0.6, 110, 50), breaks(0.5, -80, 40), overloads_its_shoulder(6),
               overloads_its_shoulder(12)},
              "of joints under too much load");
}

}  // namespace
}  // namespace parhelion::simulation
