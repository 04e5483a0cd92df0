// JSON messages for pages, one function each. Lengths are rounded to 0.1 mm.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocols/codec.hpp"
#include "protocols/zone.hpp"
#include "server/runtime/trainee_view.hpp"
#include "server/station/entity_table.hpp"
#include "server/station/http/identity.hpp"
#include "server/station/score_board.hpp"
#include "server/station/sensor_watch.hpp"
#include "server/station/session_controls.hpp"

namespace parhelion::station {

/// Shapes of a body; nullptr: unknown.
using ShapesOf = std::function<const std::vector<Shape>*(const std::string& entity, const std::string& part)>;
/// Name of an agent's robot model; empty: none.
using ModelOf = std::function<std::string(const std::string& entity)>;

std::string entities_json(const EntityTable& table, const ShapesOf& shapes_of, const ModelOf& model_of);
/// Times are in s after `start`.
std::string events_json(std::span<const Event> events, SimulationTime start);
std::string score_json(const ScoreBoard& board, SimulationTime start, SimulationTime now);
std::string status_json(const ServerStatus& status, const std::vector<SensorState>& sensors);
std::string injection_json(const ScanInfo& info);
std::string pose_json(const PoseEstimate& estimate);

/// One of several trainees' robots, for the list of all.
struct RobotLine {
  std::string name;
  bool localized = false;
  std::optional<double> silent_s;  ///< s since the newest POSE_COV, where it has stopped
  bool injecting = false;
  std::string reason;           ///< why nothing is injected, else empty
  std::optional<double> score;  ///< none: not graded
};
std::string robots_json(std::span<const RobotLine> robots);
std::string operators_json(std::span<const OperatorStatus> statuses);
/// When what a trainee knows was sensed last; empty: of a view that sees everything.
std::string known_json(const runtime::KnownWorld& world, SimulationTime start);
std::string control_json(const ControlState& state);
std::string hazard_json(const HazardReading& reading, double t);
std::string joints_json(const std::string& robot, const Joints& joints);
std::string zones_json(std::span<const Zone> zones);
std::string model_json(std::uint64_t version);
std::string reply_json(std::uint64_t request, const Status& done, const std::string& text);

struct EntityPlan {
  std::string entity;
  const char* kind = "path";            ///< "path": its commanded path; "predicted": its extrapolated motion
  std::vector<Eigen::Vector2d> points;  ///< m, map
};
std::string plans_json(std::span<const EntityPlan> plans);

/// A chat message of a session. Recipients: those of a role, or one person; neither: everybody. A person may
/// have the name of a role.
struct ChatLine {
  double t = 0;      ///< s of the session
  std::string from;  ///< name of a person
  Role role = Role::observer;
  std::optional<Role> to_role;
  std::string to_person;
  std::string text;
};
struct MarkLine {
  double t = 0;
  std::string by, text;
};
std::string chat_json(const ChatLine& line);
std::string mark_json(const MarkLine& line);

}  // namespace parhelion::station
