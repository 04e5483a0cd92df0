// A trainee's tasks and their grading: conditions over events and the world, tasks, penalties.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocols/event.hpp"

namespace parhelion {

/// A condition. An empty subject is the graded robot; any other empty field matches all. Composed conditions
/// nest up to the YAML reader's limit.
struct Condition {
  enum class Kind : std::uint8_t {
    event,    ///< `count` events of `event` by `subject` about `object`, at least `impulse`, `min` to `max`
    reach,    ///< it is in the zone `target`
    pass,     ///< it went through the opening of the door `target`, from one side to the other
    climb,    ///< it is up the flight of stairs `target`
    near,     ///< its origin is within `distance` (in the plane) of that of `target`, continuously for
              ///< `duration`
    still,    ///< it has not moved for `duration`
    inspect,  ///< `target` is in its camera's view, no farther than `distance`, not occluded by the building,
              ///< continuously for `duration`
    follow,   ///< like near, for an agent
    avoid,    ///< for `duration` it came no nearer to `target` than `distance`, or (0) did not touch it; else
              ///< failed
    report,   ///< the trainee reported `target` as found, and (with `distance`) its position within that
    grip,     ///< its gripper holds `target`
    lift,     ///< its gripper holds `target` 2 cm over its initial position
    place,    ///< it released `target`, which rests in the container `into` (empty: any)
    pitch,  ///< at least `amount` (rad) either way, continuously for `duration`, by MR_WORLD; the next three
            ///< likewise
    roll,
    yaw_rate,  ///< rad/s
    speed,     ///< m/s
    all,       ///< each of `parts`, in any order
    any,       ///< one of them
    then       ///< one after the other
  };
  Kind kind = Kind::event;
  EventKind event = EventKind::contact_started;
  std::string subject, object;
  double impulse = 0;              ///< N s
  std::optional<double> min, max;  ///< of the event's value
  std::string text;                ///< the event's; empty: any
  std::uint64_t count = 1;
  std::string target, into;
  double amount = 0;    ///< of pitch, roll, yaw_rate, speed
  double distance = 0;  ///< m
  double duration = 0;  ///< s
  std::vector<Condition> parts;
  std::optional<double> within;  ///< s from when it began to be evaluated; later: it has failed
  std::vector<Condition> never;  ///< none or one: once that holds, this condition has failed
};

struct Task {
  std::string name;
  std::string text;             ///< for the briefing
  double points = 0;            ///< awarded when it is done
  bool required = false;        ///< required to pass
  std::optional<double> limit;  ///< s from its start
  Condition done;
  std::vector<Condition> failed;    ///< none or one
  std::vector<std::string> skills;  ///< that it trains, without duplicates
};

struct Penalty {
  std::string name;
  double points = 0;          ///< deducted each time
  double per_impulse = 0;     ///< points per N s of the event that triggered it
  std::optional<double> max;  ///< points, maximum in total
  Condition when;             ///< evaluated anew each time after it has held
};

struct GradeStep {
  std::string name;
  double from = 0;  ///< minimum fraction of the points, 0..1
};

struct Training {
  std::string robot;            ///< graded robot; empty: the trainee's
  std::string text;             ///< for the briefing
  std::optional<double> limit;  ///< s, for all tasks
  bool on_command = true;       ///< the clock starts at MR_START or the first command; else with the session
  bool in_order = true;         ///< a task begins when the previous one has ended; else all at once
  /// Driving into a real person (event person_touched) costs all points and fails the session; false: only
  /// the penalties decide.
  bool person_contact_fails = true;
  double pass_mark = 0;           ///< fraction of the points, 0..1
  std::vector<GradeStep> grades;  ///< the best first
  std::vector<Task> tasks;        ///< names are unique
  std::vector<Penalty> penalties;
};

}  // namespace parhelion
