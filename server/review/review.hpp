// The content of an after-action review: one session, read once from its log.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/review/marks.hpp"
#include "server/review/pictures.hpp"
#include "server/review/plan.hpp"
#include "server/review/series.hpp"
#include "server/review/track.hpp"
#include "server/runtime/grade_session.hpp"

namespace parhelion::review {

/// Whom the review is for: a trainee is shown what the robot has sensed, as in the session.
enum class Reader : std::uint8_t { instructor, trainee };

struct ReviewLimits {
  std::size_t windows = 600;          ///< of each plot
  std::size_t path_points = 3000;     ///< of the graded robot
  std::size_t agent_points = 20'000;  ///< of all other agents together
  std::size_t events_of_kind = 150;
  std::size_t deduction_pictures = 40, strip_pictures = 40;
};

/// Path of a robot, a person or another agent.
struct Trail {
  std::string entity;
  AgentKind kind = AgentKind::box;
  Track track;
};

/// Times are in seconds after `begin`, positions in m in the map frame.
struct SessionReview {
  std::string log;    ///< file name without its folder
  std::string robot;  ///< whose session this is
  Scenario scenario;
  std::vector<Eigen::Vector2d> footprint;  ///< of the robot, if the log has its description; else empty
  SimulationTime begin;
  double duration = 0;
  std::optional<training::Grade> grade;  ///< none: no training section, or it grades another robot
  bool cut_off = false;                  ///< the log has no end record
  std::uint64_t skipped_bytes = 0;
  Plan plan;
  Trail path;
  std::vector<Trail> agents;                             ///< by name
  std::vector<Event> events;                             ///< in the order of time, thinned
  std::map<std::string, std::uint64_t> events_left_out;  ///< by kind; repeated contact events are never
                                                         ///< listed
  std::vector<Mark> marks;                               ///< the instructor's; not for trainees
  /// By name: speed, pitch, roll, nearest, nearest_injected, commanded_forward, commanded_turn,
  /// applied_forward, applied_turn, delay_scan, delay_camera, delay_teleop. Series without samples in the log
  /// are missing.
  std::map<std::string, Series> series;
  /// s, smallest delay from sensor to server, by series; plots show the excess over it, since clocks may
  /// differ.
  std::map<std::string, double> min_delay;
  std::vector<Picture> pictures;
  std::uint64_t pictures_seen = 0, pictures_unreadable = 0;
};

/// Error: not a session log, its training section refers to something that does not exist, or it has no robot
/// of the name `robot` (empty: the first that is graded). `progress`: bytes done and bytes in total; may be
/// empty.
Result<SessionReview> review_session(const std::string& path, const ReviewLimits& limits = {},
                                     const std::function<void(std::uint64_t, std::uint64_t)>& progress = {},
                                     Reader reader = Reader::instructor, const std::string& robot = {});

}  // namespace parhelion::review
