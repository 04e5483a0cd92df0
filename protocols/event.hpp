// What happened in the session (channel MR_EVENTS): what the grader reads.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "protocols/time.hpp"

namespace parhelion {

enum class EventKind : std::uint8_t {
  command_accepted,  ///< answer to an AgentCommand: after it was written to the log
  command_refused,   ///< `text` says why and, for a place that is taken, where there is room
  agent_spawned,
  agent_moved,
  agent_removed,
  collision_started,
  collision_stopped,
  pose_lost,
  pose_recovered,
  relocalized,
  command_reduced,  ///< virtual contact held TELEOP back (start of it)
  command_restored,
  injection_degraded,
  injection_restored,
  model_changed,        ///< a new version of the model took the old one's place; `text` says which
  collision_continued,  ///< a contact goes on; impulse: the largest of one step since it was said last
  movement_started,
  movement_stopped,
  joint_broken,     ///< object: the joint
  joint_overload,   ///< object: the joint; value: torque or force that it asked for over what it can give
  joints_restored,  ///< a reset: broken joints hold again
  door_opened,      ///< value: rad, how far its leaf is turned from where it closes its opening
  door_closed,
  door_unhinged,  ///< pushed off its hinge; impulse: what broke it
  door_space_entered,
  door_space_left,
  step_climbed,   ///< object: the step; value: m, height of the robot over where it began
  fell,           ///< value: m, how deep
  tipped_over,    ///< value: rad, angle between its z axis and up
  pitch_warning,  ///< value: rad; so for roll
  pitch_limit,
  roll_warning,
  roll_limit,
  yaw_rate_warning,  ///< value: rad/s
  yaw_rate_limit,
  gripped,  ///< two of the gripper's links press on object; value: N, the smaller force
  lifted,   ///< object is held 2 cm over where it lay; value: m
  dropped,  ///< object slipped 4 cm in the gripper, or fell out of it; value: m over where it lay
  placed,   ///< what was let go of rests in object, a container; text: its name
  zone_entered,
  zone_left,
  collision_predicted,  ///< along the present motion; value: s until it
  tipping_predicted,    ///< value: s until it
  hazard_set_off,       ///< object: who came near; text: by what, its value beside it in N s, rad, m or s
  radio_lost,           ///< value: dBm at the receiver
  radio_restored,
  battery_low,  ///< value: share that is left, 0..1
  battery_empty,
  operator_switched,  ///< object: the robot that the operator drives from now on
  console_lost,       ///< the operator's console went silent or was unplugged
  foreign_publisher,  ///< somebody else publishes on a channel of the simulated robot; object: the channel
  goal_reached,       ///< of an agent that goes; value: how many waypoints it has reached
  goal_unreachable,   ///< no way leads there; text: what is in the way, where that is known
  script_started,     ///< subject: the script; object: whose event set it off
  task_started,       ///< grading; object: the task; value: points that it can give
  task_done,          ///< object: the task; value: points that it gave; text: what decided
  task_failed,        ///< so too, or time was up
  penalty_charged,    ///< object: the rule; value: points that it took; text: what set it off
  score_changed,    ///< object: the task or the rule; value: the score from now on; text: points more or less
  grading_ended,    ///< value: the score, which nothing changes any more; text: the grade, passed or not
  object_reported,  ///< object: what the trainee says to have found; value: m between the place said and
                    ///< where it is; -1: no place was said, or nothing has that name
  deadman_pressed,  ///< TELEOP comes (again)
  deadman_released,  ///< TELEOP has gone silent; value: m/s of its last motion, had that just been asked for
  lesson_started,    ///< object: the lesson; value: its amount; text: the side of a dead wheel
  lesson_ended,      ///< so too
  near_miss,       ///< passed without a touch; text: "gap" or "time"; value: the smallest gap in m, the least
                   ///< time to a collision in s (server/simulation/near_miss.hpp)
  agent_withheld,  ///< the subject's sensors do not show object: its returns would be too uncertain
  agent_shown,     ///< they show it again
};
inline constexpr EventKind kLastEventKind = EventKind::agent_shown;

/// Said by the grading itself: never graded.
inline bool is_grading(EventKind kind) {
  return kind >= EventKind::task_started && kind <= EventKind::grading_ended;
}

enum class PairKind : std::uint8_t { none, real_real, real_virtual, virtual_virtual };

struct Event {
  SimulationTime stamp;  ///< when it happened
  EventKind kind = EventKind::agent_spawned;
  std::string subject;  ///< entity that it is about
  std::string object;   ///< the other one, or empty
  PairKind pair = PairKind::none;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, map frame, where it has a place
  double impulse = 0;                                  ///< N s, of a contact
  double value = 0;                                    ///< measured figure; its unit and meaning by kind
  bool unsensed = false;                               ///< while injection was degraded: never scored
  std::uint64_t request = 0;
  std::string text;
};

const char* to_string(EventKind kind);

}  // namespace parhelion
