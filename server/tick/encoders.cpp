#include "server/tick/encoders.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "protocols/channels.hpp"
#include "protocols/nearest_name.hpp"
#include "server/simulation/robots/robot_twin.hpp"

namespace parhelion::tick {
namespace {

using simulation::JointKind;
using simulation::RobotJoint;

constexpr double kAhead = 0.1;   // s of extrapolation
constexpr double kCatchUp = 3;   // times the joint's greatest velocity, where it follows its encoder
constexpr double kFaster = 1.5;  // times the joint's greatest velocity: plays of stamps and loads
constexpr double kDoubt = 0.5;   // s until a jump is believed
constexpr double kPlay[] = {0.03, 0.003};  // rad and m beyond limits and speeds: resolution and calibration

double play(const RobotJoint& joint) { return kPlay[joint.kind == JointKind::prismatic ? 1 : 0]; }
const char* unit(const RobotJoint& joint) { return joint.kind == JointKind::prismatic ? "m" : "rad"; }

bool is_limited(const RobotJoint& joint) {
  return joint.kind == JointKind::revolute || joint.kind == JointKind::prismatic;
}

bool rolls(const simulation::RobotModel& model, const RobotJoint& joint) {
  const auto& runners = model.drive.runners;
  return std::any_of(runners.begin(), runners.end(), [&](const simulation::RobotRunner& runner) {
    return runner.kind == simulation::RobotRunner::Kind::wheel && runner.link == joint.child;
  });
}

bool steers(const simulation::RobotModel& model, std::size_t joint) {
  const auto& runners = model.drive.runners;
  return std::any_of(runners.begin(), runners.end(),
                     [&](const simulation::RobotRunner& runner) { return runner.steering == joint; });
}

std::string outside(const RobotJoint& joint, double position) {
  if (std::isfinite(position) && (!is_limited(joint) || (position >= joint.lower - play(joint) &&
                                                         position <= joint.upper + play(joint))))
    return {};
  char text[200];
  std::snprintf(text, sizeof text, "joint '%s' is reported at %.3f %s, outside its limits %.3f to %.3f",
                joint.name.c_str(), position, unit(joint), joint.lower, joint.upper);
  return text;
}

double velocity_between(const Encoder::Sample& from, const Encoder::Sample& to) {
  return (to.position - from.position) / (to.stamp - from.stamp).seconds();
}

bool can_move(const RobotJoint& joint, const Encoder::Sample& from, const Encoder::Sample& to) {
  const double longest = kFaster * joint.velocity * (to.stamp - from.stamp).seconds() + play(joint);
  return std::abs(to.position - from.position) <= longest;
}

/// Believes it where the joint can have moved there, or has been there for long enough.
void add(const RobotJoint& joint, Encoder::Sample sample, Encoder& encoder) {
  if (encoder.problem = outside(joint, sample.position); !encoder.problem.empty()) return;
  if (!encoder.newest || can_move(joint, *encoder.newest, sample)) {
    encoder.newest = sample;
    encoder.doubted.reset();
    return;
  }
  if (!encoder.doubted || !can_move(joint, *encoder.doubted, sample)) encoder.doubted_since = sample.stamp;
  encoder.doubted = sample;
  if ((sample.stamp - encoder.doubted_since).seconds() >= kDoubt) {
    encoder.newest = sample;
    encoder.doubted.reset();
    return;
  }
  char text[200];
  std::snprintf(text, sizeof text,
                "joint '%s' jumps from %.3f to %.3f %s in %.0f ms; it moves %.2f %s/s at most",
                joint.name.c_str(), encoder.newest->position, sample.position, unit(joint),
                1e3 * (sample.stamp - encoder.newest->stamp).seconds(), joint.velocity, unit(joint));
  encoder.problem = text;
}

void report_unknown(const TickContext& context, const std::string& name, EncoderState& state) {
  constexpr std::size_t max_names = 256;
  if (state.unknown.size() >= max_names || !state.unknown.insert(name).second) return;
  std::vector<std::string> known;
  for (const RobotJoint& joint : state.model->joints) known.push_back(joint.name);
  refuse(context, {context.channel(channel::kJointState) + ": robot model '" + state.model->name +
                   "' has no joint '" + name + "'" + suggestion_or_known(name, known)});
}

/// Empty: all that is needed is known.
std::string why_lost(const TickContext& context, const ClockOffset& clock, const EncoderState& state) {
  const double limit = context.configuration.scenario.contact.silence;
  for (const Encoder& encoder : state.encoders) {
    if (!encoder.needed) continue;
    if (!encoder.problem.empty()) return encoder.problem;
    const std::string& name = state.model->joints[encoder.joint].name;
    if (!encoder.newest) return "no JOINT_STATE with joint '" + name + "' yet";
    if ((context.now - clock.to_server(encoder.newest->stamp)).seconds() > limit)
      return "no JOINT_STATE with joint '" + name + "' for " + std::to_string(std::lround(1e3 * limit)) +
             " ms";
  }
  return {};
}

/// Another reason than the reported one; not the same with other numbers, and not more often than each two
/// seconds.
bool has_another_reason(const TickContext& context, const EncoderState& state) {
  constexpr Duration again = seconds(2.0);
  return !state.fresh && context.now - state.reported >= again &&
         without_numbers(state.why) != state.reported_why;
}

void report(const TickContext& context, EncoderState& state) {
  if (state.reported_lost == !state.fresh && !has_another_reason(context, state)) return;
  state.reported_lost = !state.fresh;
  state.reported = context.now;
  state.reported_why = without_numbers(state.why);
  Event event;
  event.stamp = context.now;
  event.kind = state.fresh ? EventKind::encoders_back : EventKind::encoders_lost;
  event.subject = context.robot().name;
  event.text = state.why;
  publish_event(context, event);
}

void extrapolate(const RobotJoint& joint, const Encoder::Sample& sample, double age, double& position,
                 double& velocity) {
  const double fastest = kFaster * joint.velocity;
  velocity = std::clamp(sample.velocity, -fastest, fastest);
  position = sample.position + velocity * std::clamp(age, 0.0, kAhead);
  if (is_limited(joint))
    position = std::clamp(position, joint.lower - play(joint), joint.upper + play(joint));
  if (age >= kAhead) velocity = 0;
}

}  // namespace

std::shared_ptr<const simulation::RobotModel> model_named(const Configuration& configuration,
                                                          const std::string& name) {
  const auto& models = configuration.robot_models;
  const auto found =
      std::find_if(models.begin(), models.end(), [&](const auto& each) { return each->name == name; });
  return name.empty() || found == models.end() ? nullptr : *found;
}

EncoderState::EncoderState(const Configuration& configuration, const RobotDescription& robot) {
  if (simulates_trainee(configuration.scenario)) return;
  model = model_named(configuration, robot.model);
  if (!model) return;
  const simulation::RobotTwin twin(model);
  for (std::size_t i = 0; i < model->joints.size(); ++i) {
    const RobotJoint& joint = model->joints[i];
    posture.positions.push_back(joint.start);
    posture.velocities.push_back(0);
    if (joint.kind == JointKind::fixed || joint.geared) continue;
    Encoder encoder;
    encoder.joint = i;
    encoder.needed = !rolls(*model, joint) && !steers(*model, i);
    encoder.grips = twin.grips(i);
    encoders.push_back(encoder);
  }
}

void doubt_encoders(const Error& error, EncoderState& state) {
  for (Encoder& encoder : state.encoders) encoder.problem = error.message;
}

void take_encoders(const TickContext& context, const Joints& joints, EncoderState& state) {
  if (!state.exist() || joints.positions.empty()) return;
  for (std::size_t i = 0; i < joints.names.size(); ++i) {
    const auto& all = state.model->joints;
    const auto named = std::find_if(all.begin(), all.end(),
                                    [&](const RobotJoint& each) { return each.name == joints.names[i]; });
    if (named == all.end()) {
      report_unknown(context, joints.names[i], state);
      continue;
    }
    const auto index = static_cast<std::size_t>(named - all.begin());
    const auto encoder = std::find_if(state.encoders.begin(), state.encoders.end(),
                                      [&](const Encoder& each) { return each.joint == index; });
    if (encoder == state.encoders.end()) continue;
    // The way since the last message carries all joints on alike. Their speeds at the instant of the message
    // do not: a servo that has just reached its target stands, while the others of the same motion run.
    Encoder::Sample sample{joints.stamp, joints.positions[i], 0};
    if (encoder->newest && sample.stamp <= encoder->newest->stamp) continue;
    if (encoder->newest) {
      sample.velocity = velocity_between(*encoder->newest, sample);
    } else if (!joints.velocities.empty()) {
      sample.velocity = joints.velocities[i];
    }
    if (rolls(*state.model, *named)) {
      encoder->newest = sample;
    } else {
      add(*named, sample, *encoder);
    }
  }
}

void move_twin(const TickContext& context, const ClockOffset& clock, EncoderState& state,
               simulation::Simulation& simulation) {
  if (!state.exist()) return;
  if (!state.awaited_since) state.awaited_since = context.now;
  state.why = clock.known() ? why_lost(context, clock, state) : "no JOINT_STATE yet";
  const bool was_fresh = std::exchange(state.fresh, state.why.empty());
  const double dt = (simulation.next_step() - simulation.now()).seconds();
  for (const Encoder& encoder : state.encoders) {
    if (!encoder.newest || !clock.known()) continue;
    const RobotJoint& joint = state.model->joints[encoder.joint];
    double& position = state.posture.positions[encoder.joint];
    double& velocity = state.posture.velocities[encoder.joint];
    if (!state.fresh) {
      velocity = 0;
    } else if (encoder.grips && was_fresh) {
      const double step = kCatchUp * joint.velocity * dt;
      const double moves = std::clamp(encoder.newest->position - position, -step, step);
      position += moves;
      velocity = moves / dt;
    } else {
      const double age = (context.now - clock.to_server(encoder.newest->stamp)).seconds();
      extrapolate(joint, *encoder.newest, encoder.grips ? 0 : age, position, velocity);
    }
  }
  simulation.set_encoders(state.posture, state.fresh, context.robot_index);
  const bool waits = !state.fresh && (context.now - *state.awaited_since).seconds() <
                                         context.configuration.scenario.contact.silence;
  if (!waits) report(context, state);
}

}  // namespace parhelion::tick
