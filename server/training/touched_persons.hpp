// Whose fault it is when a robot drives into a real person (event person_touched).
#pragma once

#include <map>
#include <set>
#include <string>

#include "protocols/codec.hpp"
#include "protocols/event.hpp"

namespace parhelion::training {

/// Name of the deduction for it.
inline constexpr const char* kPersonTouched = "drove into a person";

/// Knows from the recording who drives which robot.
class TouchedPersons {
 public:
  /// `robot`: the graded one.
  explicit TouchedPersons(std::string robot) : robot_(std::move(robot)) {}

  void take(const WorldMessage& world);
  /// True: a person was touched by the graded robot, or by a virtual robot that its trainee drives. Who
  /// drives another trainee's robot, or drove it last, is another trainee.
  bool take(const Event& event);

 private:
  struct Operator {
    std::string drives;  // empty: none now
    std::string home;    // the trainee's robot that it drove last; empty: none
  };
  void note(const Event& switched);
  bool is_of_its_trainee(const std::string& robot) const;

  std::string robot_;
  std::string names_;                      // of all trainees' robots, as in MR_WORLD
  std::set<std::string> trainees_robots_;  // the same

  // By name, which comes from the bus: beyond kMaxOperators one that drives nothing now is forgotten; while
  // all drive, new ones are left out.
  static constexpr std::size_t kMaxOperators = 1000;
  std::map<std::string, Operator> operators_;
};

}  // namespace parhelion::training
