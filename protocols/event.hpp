// Events of the session (channel MR_EVENTS): the input of grading.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "protocols/time.hpp"

namespace parhelion {

enum class EventKind : std::uint8_t {
  command_accepted,  ///< reply to an AgentCommand, after it was written to the log
  command_refused,   ///< `text` gives the reason and, for an occupied place, where there is room
  agent_spawned,
  agent_moved,
  agent_removed,
  contact_started,
  contact_ended,
  localization_lost,
  localized,
  relocalized,
  speed_limited,  ///< virtual contact limits TELEOP (start of it)
  speed_limit_lifted,
  injection_suspended,
  injection_active,
  model_changed,      ///< a new version of the model replaced the old one; `text` gives the version
  contact_continues,  ///< a contact continues; impulse: the largest of one step since the last report
  movement_started,
  movement_stopped,
  joint_broken,     ///< object: the joint
  joint_overload,   ///< object: the joint; value: required torque or force relative to its limit
  joints_restored,  ///< a reset: broken joints are intact again
  door_opened,      ///< value: rad, opening angle of its leaf
  door_closed,
  door_unhinged,  ///< pushed off its hinge; impulse: the one that broke it
  door_space_entered,
  door_space_left,
  step_climbed,   ///< object: the step; value: m, height of the robot over its start
  fell,           ///< value: m, depth of the fall
  tipped_over,    ///< value: rad, angle between its z axis and up
  pitch_warning,  ///< value: rad; the same for roll
  pitch_limit,
  roll_warning,
  roll_limit,
  yaw_rate_warning,  ///< value: rad/s
  yaw_rate_limit,
  gripped,  ///< two of the gripper's links press on object; value: N, the smaller force
  lifted,   ///< object is held 2 cm over its initial position; value: m
  dropped,  ///< object slipped 4 cm in the gripper, or fell out of it; value: m over its initial position
  placed,   ///< the released object rests in object, a container; text: its name
  zone_entered,
  zone_left,
  collision_predicted,  ///< along the present motion; value: s until it occurs
  tipping_predicted,    ///< value: s until it occurs
  hazard_triggered,  ///< object: what triggered it by coming near; text: the trigger, with its value in N s,
                     ///< rad, m or s
  radio_lost,        ///< value: dBm at the receiver
  radio_restored,
  battery_low,  ///< value: remaining fraction of the charge, 0..1
  battery_empty,
  operator_switched,  ///< object: the robot that the operator drives from now on
  console_lost,       ///< the operator's console timed out or was unplugged
  foreign_publisher,  ///< another publisher sends on a channel of the simulated robot; object: the channel
  goal_reached,       ///< of an agent that goes; value: number of waypoints reached
  goal_unreachable,   ///< there is no path; text: the obstacle, where known
  script_started,     ///< subject: the script; object: subject of the event that triggered it
  task_started,       ///< grading; object: the task; value: its points
  task_done,          ///< object: the task; value: points awarded; text: what decided it
  task_failed,        ///< the same, or its time was up
  points_deducted,    ///< object: the rule; value: points deducted; text: what triggered it
  score_changed,      ///< object: the task or the rule; value: the new score; text: change in points
  grading_ended,      ///< value: the final score; text: the grade, passed or not
  object_reported,    ///< object: the object that the trainee reports; value: m between the reported and the
                      ///< true position; -1: no position was reported, or no object has that name
  dead_man_pressed,   ///< TELEOP is received (again)
  dead_man_released,  ///< TELEOP timed out; value: m/s of its last motion, if it was commanded just before
  fault_started,      ///< object: the fault; value: its amount; text: the side of a dead wheel
  fault_ended,        ///< the same
  near_miss,          ///< passed without contact; text: "gap" or "time"; value: the smallest gap in m, or the
                      ///< smallest time to a collision in s (server/simulation/bodies/near_miss.hpp)
  agent_hidden,       ///< the subject's sensors do not show object: its returns would be too uncertain
  agent_shown,        ///< the subject's sensors show object again
  odometry_changed,   ///< scans show another time offset or scale of odometry than at the last such event;
                      ///< value: s, to add to its stamps; text: that and the scales
  poses_conflict,  ///< two real robots are estimated to be in one place: one of the poses is wrong; value: m
                   ///< that their outlines overlap, beyond what the poses' uncertainty explains
  dose_warning,    ///< of a robot; object: radiation or gas; value: its dose since the start; text: the unit
  dose_limit,      ///< the same
  payload_exceeded,  ///< object is too heavy for the gripper that closes on it; value: its mass relative to
                     ///< the gripper's limit
  joint_limited,  ///< a joint command of a real robot is reduced; object: the joint; text: what is in its way
  joint_limit_lifted,  ///< object: the joint
  encoders_lost,  ///< JOINT_STATE is silent or not plausible: gripping is frozen and joint commands are a
                  ///< stop; text: why
  encoders_back,
  person_touched,    ///< the subject drove into a real person, the object: the worst that can happen; value:
                     ///< m/s, its speed towards that person
  training_started,  ///< the clock of the training starts; subject: the robot that was commanded first, or
                     ///< moved; empty: the instructor's start
  scans_conflict,    ///< the subject's scans have other beams than its description, or two publishers
                   ///< alternate; object: the name of a laser after the first; text: figures, and what to do
};
inline constexpr EventKind kLastEventKind = EventKind::scans_conflict;

/// Reported by the grading itself: never graded.
inline bool is_grading(EventKind kind) {
  return kind >= EventKind::task_started && kind <= EventKind::grading_ended;
}

enum class PairKind : std::uint8_t { none, real_real, real_virtual, virtual_virtual };

struct Event {
  SimulationTime stamp;  ///< when it happened
  EventKind kind = EventKind::agent_spawned;
  std::string subject;  ///< entity that the event is about
  std::string object;   ///< the other one, or empty
  PairKind pair = PairKind::none;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, map frame, where it has a place
  double impulse = 0;                                  ///< N s, of a contact
  double value = 0;           ///< measured value; unit and meaning depend on the kind
  bool undetectable = false;  ///< while injection was degraded: never scored
  std::uint64_t request = 0;
  std::string text;
};

const char* to_string(EventKind kind);

}  // namespace parhelion
