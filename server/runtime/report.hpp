// Results of a run: the figures of --report, and MR_STATUS.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "protocols/robot.hpp"
#include "server/runtime/grade_session.hpp"
#include "server/runtime/outbox.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/tick/outputs.hpp"
#include "server/tick/percentiles.hpp"
#include "server/tick/tally.hpp"

namespace parhelion::tick {
struct LiveGrading;
struct RobotState;
}  // namespace parhelion::tick
namespace parhelion::runtime {

/// Measures the stages of the tick.
class StageClock : public tick::StageObserver {
 public:
  /// `robots`: their number.
  explicit StageClock(std::size_t robots = 1) : robots_scan_us(robots) {}

  /// At the arrival of an input, before the tick; `robot`: whose input it is.
  void begin(std::size_t robot = 0);
  void ended(tick::Stage stage) override;

  tick::Percentiles physics_step_us, physics_wait_us, scan_us;
  std::vector<tick::Percentiles> robots_scan_us;  ///< scan_us, by robot

 private:
  WallTime begun_, last_;
  WallTime waited_;
  std::size_t robot_ = 0;
};

/// Figures of one of several robots.
struct RobotReport {
  std::string name;
  std::uint64_t scans_in = 0, scans_degraded = 0, guard_fired = 0;
  tick::Percentiles scan_us, scan_in_to_out_us;  ///< as in Report
};

/// Counts of a planar laser after its robot's first; the robot's counts include them.
struct LaserReport {
  std::string robot;  ///< empty: there is one
  std::string name;
  std::uint64_t scans_in = 0, scans_degraded = 0, guard_fired = 0;
};

/// Contents of --report. Times in microseconds, from the wall clock; everything else is the same for the same
/// log.
struct Report {
  std::string source;
  tick::Tally tally;
  std::uint64_t frames_dropped = 0, agent_frames_dropped = 0;
  std::uint64_t inputs_dropped = 0;  ///< by full queues
  std::uint64_t log_damage_bytes = 0;
  std::uint64_t guard_fired = 0;
  std::optional<std::uint64_t> messages_refused;  ///< by their signatures; none: nothing is signed
  std::uint64_t arrivals_corrected = 0;           ///< log events whose timestamp did not increase
  tick::Percentiles
      scan_in_to_out_us;  ///< live: from receipt on the bus to MR_SCAN on it, including the wait in the inbox
  tick::Percentiles scan_us, frame_us, agent_frame_us, physics_step_us, physics_wait_us;
  std::vector<RobotReport> robots;  ///< empty: there is one robot
  std::vector<LaserReport> lasers;  ///< of all robots, those after the first
  double log_seconds = 0, wall_seconds = 0;
  bool complete = true;
  std::string incomplete_because;
  std::optional<GradedSession> grade;  ///< of the first graded robot; none: the scenario has no training
  std::vector<GradedSession> grades;   ///< of each graded robot
  std::map<std::string, std::string> hash;
  std::map<std::string, std::string> notes;  ///< such as that the camera was simulated by a stand-in
};

/// Sets `complete` and the reason if not: a write failed, or published scans are missing in the log.
void report_completeness(const Outbox& outbox, Report& report);
/// Fills Report::robots, if there are several, and Report::lasers.
void report_robots(const std::vector<tick::RobotState>& robots, const StageClock& stages, Report& report);
/// Adds a note if the robot description or the renderer prevents augmentation of images.
void note_what_images_lack(const RobotDescription& robot, const std::string& render_fault, Report& report);

/// The current live grades, of each graded robot; none if `grading` is null. `log`: for GradedSession::log.
std::vector<GradedSession> grades_now(const tick::Configuration& configuration,
                                      const tick::LiveGrading* grading, const std::string& log);

/// MR_STATUS at `now`, with the same figures.
ServerStatus to_status(const Report& report, ArrivalTime now);
std::string to_json(const Report& report);
/// A summary of a few lines.
std::string summary(const Report& report);

}  // namespace parhelion::runtime
