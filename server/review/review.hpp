// What an after-action review is made of: one session, read once from its log.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/review/pictures.hpp"
#include "server/review/plan.hpp"
#include "server/review/series.hpp"
#include "server/review/track.hpp"
#include "server/runtime/grade_session.hpp"

namespace parhelion::review {

struct ReviewLimits {
  std::size_t windows = 600;          ///< of each plot
  std::size_t path_points = 3000;     ///< of the graded robot
  std::size_t agent_points = 20'000;  ///< of all others together
  std::size_t events_of_kind = 150;
  std::size_t charge_pictures = 40, strip_pictures = 40;
};

/// How somebody went: a robot, a person, whatever moves.
struct Trail {
  std::string entity;
  AgentKind kind = AgentKind::box;
  Track track;
};

/// Times are in seconds after `begin`; places in m, map frame.
struct SessionReview {
  std::string log;    ///< name of the file, without its folder
  std::string robot;  ///< that is graded
  Scenario scenario;
  std::vector<Eigen::Vector2d> footprint;  ///< of the robot, where the description is its own; else empty
  SimulationTime begin;
  double duration = 0;
  std::optional<training::Grade> grade;  ///< none: the scenario says nothing of training
  bool cut_off = false;                  ///< the log has no end: it stops in the middle
  std::uint64_t skipped_bytes = 0;
  Plan plan;
  Trail path;
  std::vector<Trail> agents;                             ///< by name
  std::vector<Event> events;                             ///< by their instants, thinned
  std::map<std::string, std::uint64_t> events_left_out;  ///< by kind; contacts that go on are never listed
  /// By name: speed, pitch, roll, nearest, nearest_injected, asked_forward, asked_turn, given_forward,
  /// given_turn, delay_scan, delay_camera, delay_teleop. Those of which the log says nothing are not there.
  std::map<std::string, Series> series;
  /// s: sensor to server, the least there was, by series; what is plotted is over that. Clocks may differ.
  std::map<std::string, double> least_delay;
  std::vector<Picture> pictures;
  std::uint64_t pictures_seen = 0, pictures_unreadable = 0;
};

/// Error: no session log, or a training that names what is not there. `progress`: bytes done and of all; may
/// be empty.
Result<SessionReview> review_session(const std::string& path, const ReviewLimits& limits = {},
                                     const std::function<void(std::uint64_t, std::uint64_t)>& progress = {});

}  // namespace parhelion::review
