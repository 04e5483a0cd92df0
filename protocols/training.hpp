// What a trainee is to do and how it is graded: conditions over events and the world, tasks, penalties.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocols/event.hpp"

namespace parhelion {

/// When it holds. Of a subject that is empty the robot that is graded is meant; of another that is empty any.
/// What is composed nests to any depth that YAML is read to.
struct Condition {
  enum class Kind : std::uint8_t {
    event,  ///< `count` events of `event` by `subject` about `object`, at least `impulse`, `least` to `most`
    reach,  ///< it is in the zone `target`
    pass,   ///< it went through the opening of the door `target`, from one side to the other
    climb,  ///< it is up the flight of stairs `target`
    near,   ///< its origin is within `distance` (in the plane) of that of `target`, for `duration` on end
    still,  ///< it has not moved for `duration`
    inspect,  ///< `target` is in its camera's view, no farther than `distance`, not hidden by the building,
              ///< for `duration` on end
    follow,   ///< as near, of an agent
    avoid,    ///< for `duration` it came no nearer to `target` than `distance`, or (0) did not touch it; else
              ///< failed
    report,   ///< the trainee said to have found `target`, and (with `distance`) where, within that
    grip,     ///< its gripper holds `target`
    lift,     ///< it holds it 2 cm over where that lay
    place,    ///< it let go of `target`, which rests in the container `into` (empty: any)
    pitch,    ///< the least `amount` (rad) either way, for `duration` on end, by MR_WORLD; so the next three
    roll,
    yaw_rate,  ///< rad/s
    speed,     ///< m/s
    all,       ///< each of `parts`, in any order
    any,       ///< one of them
    then       ///< one after the other
  };
  Kind kind = Kind::event;
  EventKind event = EventKind::collision_started;
  std::string subject, object;
  double impulse = 0;                 ///< N s
  std::optional<double> least, most;  ///< of the event's value
  std::string text;                   ///< the event's; empty: any
  std::uint64_t count = 1;
  std::string target, into;
  double amount = 0;    ///< of pitch, roll, yaw_rate, speed
  double distance = 0;  ///< m
  double duration = 0;  ///< s
  std::vector<Condition> parts;
  std::optional<double> within;  ///< s from when it began to be looked at; later: it has failed
  std::vector<Condition> never;  ///< none or one: once that holds, this has failed
};

struct Task {
  std::string name;
  std::string text;             ///< for the briefing
  double points = 0;            ///< for doing it
  bool required = false;        ///< without it nothing is passed
  std::optional<double> limit;  ///< s from its begin
  Condition done;
  std::vector<Condition> failed;    ///< none or one
  std::vector<std::string> skills;  ///< that it trains, each once
};

struct Penalty {
  std::string name;
  double points = 0;           ///< each time
  double per_impulse = 0;      ///< points for each N s of the event that set it off
  std::optional<double> most;  ///< points, of all times together
  Condition when;              ///< looked at anew each time that it has held
};

struct GradeStep {
  std::string name;
  double from = 0;  ///< share of the points, 0..1
};

struct Training {
  std::string robot;              ///< that is graded; empty: the trainee's
  std::string text;               ///< for the briefing
  std::optional<double> limit;    ///< s, of the whole
  bool in_order = true;           ///< a task begins when the one before has ended; else all at once
  double pass_mark = 0;           ///< share of the points, 0..1
  std::vector<GradeStep> grades;  ///< the best first
  std::vector<Task> tasks;        ///< names are unique
  std::vector<Penalty> penalties;
};

}  // namespace parhelion
