// JOINT_STATE of a real robot that has a robot model: where its joints are, and whether that can be believed.
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "protocols/joints.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/clock_offset.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// The encoder of one joint.
struct Encoder {
  std::size_t joint = 0;  ///< of the robot's model
  bool needed = false;    ///< without it the robot's posture is not known
  bool grips = false;     ///< moves one finger against the other
  struct Sample {
    SensorTime stamp;
    double position = 0, velocity = 0;  ///< rad or m, and per second
  };
  std::optional<Sample> newest;   ///< believed
  std::optional<Sample> doubted;  ///< farther from the newest than the joint can move
  SensorTime doubted_since;
  std::string problem;  ///< why the newest message was not believed; empty: it was
};

struct EncoderState {
  EncoderState(const Configuration& configuration, const RobotDescription& robot);
  bool exist() const { return model != nullptr; }

  std::shared_ptr<const simulation::RobotModel> model;  ///< null: the robot has no joints that are known
  std::vector<Encoder> encoders;                        ///< of all joints that can move
  bool fresh = false;                                   ///< at the newest step
  bool reported_lost = false;                           ///< as in the newest event
  SimulationTime reported;                              ///< when that was
  std::string reported_why;                             ///< its text without numbers
  std::string why;                                      ///< not fresh
  std::optional<SimulationTime> awaited_since;
  std::set<std::string> unknown;     ///< joints of messages that the model has not, already said
  simulation::JointPosture posture;  ///< scratch
};

/// A robot model by its name; null: none.
std::shared_ptr<const simulation::RobotModel> model_named(const Configuration& configuration,
                                                          const std::string& name);

/// Takes a message that was decoded. A position outside the joint's limits, or one farther from the last than
/// the joint can move, is not believed; the latter is, once it has been there for half a second.
void take_encoders(const TickContext& context, const Joints& joints, EncoderState& state);

/// A message that could not be decoded: nothing is believed until the next one.
void doubt_encoders(const Error& error, EncoderState& state);

/// At each step: sets the posture of the robot's twin; events encoders_lost, again where the reason is
/// another one, and encoders_back. Joints are extrapolated by at most 0.1 s. Those that grip follow their
/// encoders instead: carried on while they slow down, fingers would close on a thing before they touch it,
/// and let go of it again. The posture is lost where a needed encoder has been silent for
/// ContactLimits::silence, or was not believed.
void move_twin(const TickContext& context, const ClockOffset& clock, EncoderState& state,
               simulation::Simulation& simulation);

}  // namespace parhelion::tick
