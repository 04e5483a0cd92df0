// Gripper events, detected from contacts only: gripped, lifted, dropped, placed.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "protocols/event.hpp"
#include "protocols/frames.hpp"

namespace parhelion::simulation {

/// State of a gripped object at the newest step.
struct HandledBody {
  std::uint32_t epoch = 0;  ///< changes when it was moved elsewhere
  bool rigid = true;        ///< false: a cable, for which slip is not detected
  Transform<Map, Body> T_map_body;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();    ///< m, map
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< m/s, map; relative to its container, if any
  double lowest = 0;                                   ///< m, z of its lowest point
  std::string over;                                    ///< container whose opening it is in or over
  std::string in;  ///< container that holds it: its centre is below the rim
};

/// Force of a gripper link on an object.
struct FingerForce {
  const std::string* load = nullptr;
  std::size_t finger = 0;
  double force = 0;  ///< N, normal
};

/// Of one gripper. Each event is reported at the first step in which its condition holds.
/// - gripped: two of its links press on the object with kPinch each. It ends kReleaseTime after they stopped.
/// - lifted: gripped, and its lowest point is kLift above that when gripped; repeated only after it was below
///   half of that height.
/// - dropped: lifted, and it has either slipped kSlip in the gripper, or is not pressed and sinks with kSink
///   with no container below. Reported once until it is released.
/// - placed: it was lifted, was released, and has rested in a container for kRest, in which it got less far
///   than with kStill. Its velocity at an instant says less, as contacts of a light thing jitter.
class GripperWatch {
 public:
  static constexpr double kPinch = 1.0;        // N
  static constexpr double kReleaseTime = 0.1;  // s
  static constexpr double kLift = 0.02;        // m
  static constexpr double kSlip = 0.04;        // m, relative to the centre between the links
  static constexpr double kSink = 0.5;         // m/s: 1.3 cm of free fall
  static constexpr double kStill = 0.02;       // m/s
  static constexpr double kRest = 0.3;         // s
  static constexpr double kForget = 10;        // s: an object moving this long is no longer tracked

  using Look = std::function<std::optional<HandledBody>(const std::string& load)>;
  /// `pads`: m, map, the centre between the gripper's links. `look`: none if the object no longer exists.
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
    SimulationTime followed;                          // newest step since it was released
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();  // m, since still_since, relative to its container
  };
  struct EventContext {
    const std::string& robot;
    PairKind pair;
    SimulationTime now;
    std::vector<Event>& events;
  };
  static void report(const EventContext& context, EventKind kind, const std::string& object,
                     const HandledBody& body, double value);
  void press(const std::vector<FingerForce>& forces, const Look& look, const EventContext& context);
  /// False: no longer tracked.
  static bool follow(const std::string& load, Held& held, const HandledBody& body,
                     const Eigen::Vector3d& pads, const EventContext& context);
  static bool settle(const std::string& load, Held& held, const HandledBody& body,
                     const EventContext& context);
  std::map<std::string, Held> held_;
};

}  // namespace parhelion::simulation
