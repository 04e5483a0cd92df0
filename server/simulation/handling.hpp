// What a gripper does with things, by contact alone: gripped, lifted, dropped, placed.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "protocols/event.hpp"
#include "protocols/frames.hpp"

namespace parhelion::simulation {

/// How a thing that was gripped stands at the newest step.
struct HandledBody {
  std::uint32_t epoch = 0;  ///< another one: it was put elsewhere
  bool rigid = true;        ///< false: a cable; that it slips is not seen
  Transform<Map, Body> T_map_body;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();    ///< m, map
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< m/s, map; of one in a container: against that
  double lowest = 0;                                   ///< m, z of its lowest point
  std::string over;                                    ///< container whose opening it is in or over
  std::string in;                                      ///< container that it is in: its centre, below the rim
};

/// A link of the gripper presses on a thing.
struct FingerForce {
  const std::string* load = nullptr;
  std::size_t finger = 0;
  double force = 0;  ///< N, normal
};

/// Of one gripper. Each event is reported in the step in which its condition holds first:
/// gripped: two of its links press on the thing with kPinch each. It holds the thing until they have not
///   for kLetGo.
/// lifted: held, its lowest point is kLift over where that was when it was gripped; again only after it
///   was down to half of that.
/// dropped: lifted, and either it has slipped kSlip in the gripper, or it is not pressed and sinks with
///   kSink where no container is below. Reported once until it is released.
/// placed: it was lifted, was released, and has rested in a container (slower than kStill) for kRest.
class GripperWatch {
 public:
  static constexpr double kPinch = 1.0;   // N
  static constexpr double kLetGo = 0.1;   // s
  static constexpr double kLift = 0.02;   // m
  static constexpr double kSlip = 0.04;   // m, of the thing at the middle between the links
  static constexpr double kSink = 0.5;    // m/s: 1.3 cm of free fall
  static constexpr double kStill = 0.02;  // m/s
  static constexpr double kRest = 0.3;    // s
  static constexpr double kForget = 10;   // s: what rolls about for so long is no longer looked after

  using Look = std::function<std::optional<HandledBody>(const std::string& load)>;
  /// `pads`: m, map, the middle between the gripper's links. `look`: none, where there is no such thing now.
  void update(const std::string& robot, PairKind pair, const Eigen::Vector3d& pads,
              const std::vector<FingerForce>& forces, const Look& look, SimulationTime now,
              std::vector<Event>& events);

 private:
  struct Held {
    std::uint32_t epoch = 0;
    double lay = 0;                                  // m: lowest point when it was gripped
    Eigen::Vector3d grip = Eigen::Vector3d::Zero();  // m, its frame: the pads when it was lifted
    SimulationTime pressed;                          // newest
    bool released = false, lifted = false, was_lifted = false, dropped = false;
    std::optional<SimulationTime> still_since;
  };
  struct Saying {
    const std::string& robot;
    PairKind pair;
    SimulationTime now;
    std::vector<Event>& events;
  };
  static void say(const Saying& saying, EventKind kind, const std::string& object, const HandledBody& body,
                  double value);
  void press(const std::vector<FingerForce>& forces, const Look& look, const Saying& saying);
  /// False: it is to be forgotten.
  static bool follow(const std::string& load, Held& held, const HandledBody& body,
                     const Eigen::Vector3d& pads, const Saying& saying);
  static bool settle(const std::string& load, Held& held, const HandledBody& body, const Saying& saying);
  std::map<std::string, Held> held_;
};

}  // namespace parhelion::simulation
