// Level 3 with its loop closed: `parhelion slam`, `parhelion serve`, the example's robot and a scripted
// trainee, each a process of its own, on a bus of real UDP multicast. The robot is in a building that has
// changed since its survey, among virtual people, barrels and robots.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "protocols/scenario.hpp"
#include "tests/loop/log_checks.hpp"
#include "tests/loop/site.hpp"

namespace parhelion::test {

enum class Arrangement {
  trainee_drives,           ///< the trainee drives the real robot by TELEOP, and sees MR_SCAN
  robot_drives_itself,      ///< on MR_SCAN; the trainee drives a virtual robot across its path
  careless_trainee_drives,  ///< the trainee looks at nothing: what reduces MR_CMD, and the robot, must stop
                            ///< it
  trainee_lifts,  ///< the robot stands; the trainee lifts a virtual thing with its arm into a virtual
                  ///< container
};
inline constexpr int kArrangements = 3;  ///< in turn, of drives; lifting is none
const char* to_string(Arrangement arrangement);

Scenario loop_scenario(const Site& site, Arrangement arrangement);

/// Where the robot of a site, at its start, finds a thing and a container: m, map. Throws std::runtime_error
/// where there is no room for them.
struct LiftPlaces {
  Eigen::Vector2d thing, container;
  double height = 0;  ///< m, of the thing
};
LiftPlaces lift_places(const Site& site);

struct DriveReport {
  std::uint64_t seed = 0;
  Arrangement arrangement = Arrangement::trainee_drives;
  std::string not_run;     ///< why there was no drive; empty: there was one
  double seconds = 0;      ///< from the first live scan to the end
  std::string goal;        ///< of the real robot: "reached", or why not
  std::string other_goal;  ///< of the virtual one that the trainee drives; else empty
  int bumps = 0;           ///< of the robot with the real building
  int obstacle_stops = 0;
  LogFindings log;
  double score = 0;         ///< as the server reported it at its end
  std::string differences;  ///< between live, log and replay; empty: none
  /// Whatever must not be: contacts, violations, differences. A goal that was not reached is not among them.
  std::vector<std::string> failures() const;
};

/// A robot that is not driven to its goal has the reason in `goal`. `folder` keeps all that was written.
DriveReport drive_loop(std::uint64_t seed, Arrangement arrangement, const std::filesystem::path& folder);

}  // namespace parhelion::test
