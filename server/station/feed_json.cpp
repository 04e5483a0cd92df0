#include "server/station/feed_json.hpp"

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "server/station/mesh_json.hpp"

namespace parhelion::station {
namespace {

using Json = nlohmann::json;

/// To 1e-4; null if not finite.
Json rounded(double value) {
  if (!std::isfinite(value)) return nullptr;
  const double whole = std::round(value * 1e4) / 1e4;
  return whole == 0 ? 0 : whole;  // no -0
}

Json triple(const auto& v) { return {rounded(v.x()), rounded(v.y()), rounded(v.z())}; }

/// Names are untrusted bytes: invalid UTF-8 is replaced.
std::string text_of(const Json& message) {
  return message.dump(-1, ' ', false, Json::error_handler_t::replace);
}

const char* name_of(ShapeKind kind) {
  // Until the page has fetched a mesh, it shows the bounding box.
  static constexpr const char* names[] = {"box", "cylinder", "sphere", "capsule", "box"};
  return names[static_cast<std::size_t>(kind)];
}
const char* name_of(BodyOwner owner) {
  static constexpr const char* names[] = {"agent", "robot", "building", "real_person"};
  return names[static_cast<std::size_t>(owner)];
}
const char* name_of(PairKind pair) {
  static constexpr const char* names[] = {"none", "real_real", "real_virtual", "virtual_virtual"};
  return names[static_cast<std::size_t>(pair)];
}

Json shape_json(const Shape& shape) {
  const Eigen::Quaterniond turn = shape.T_body_shape.quaternion();
  Json json{{"shape", name_of(shape.kind)},
            {"size", triple(shape.size)},
            {"at", triple(shape.T_body_shape.translation())},
            {"turn", {rounded(turn.x()), rounded(turn.y()), rounded(turn.z()), rounded(turn.w())}},
            {"colour", triple(shape.material.albedo)}};
  if (shape.mesh) json["mesh"] = mesh_id(*shape.mesh);
  return json;
}

Json event_json(const Event& event, SimulationTime start) {
  return {{"t", rounded((event.stamp - start).seconds())},
          {"kind", to_string(event.kind)},
          {"subject", event.subject},
          {"object", event.object},
          {"pair", name_of(event.pair)},
          {"position", triple(event.position)},
          {"impulse", rounded(event.impulse)},
          {"value", rounded(event.value)},
          {"text", event.text},
          {"undetectable", event.undetectable}};
}

}  // namespace

std::string entities_json(const EntityTable& table, const ShapesOf& shapes_of, const ModelOf& model_of) {
  Json forms = Json::array(), list = Json::array();
  std::map<std::string, int> form_of;  // all persons use the same one
  const auto form = [&](const EntityTable::Part& part) {
    const std::vector<Shape>* shapes = shapes_of(part.entity, part.name);
    if (shapes == nullptr) return -1;
    Json each = Json::array();
    for (const Shape& shape : *shapes) each.push_back(shape_json(shape));
    const auto [place, is_new] = form_of.try_emplace(each.dump(), static_cast<int>(forms.size()));
    if (is_new) forms.push_back(std::move(each));
    return place->second;
  };
  for (const EntityTable::Entity& entity : table.entities()) {
    Json parts = Json::array();
    for (const std::size_t number : entity.parts) {
      const EntityTable::Part& part = table.parts()[number];
      parts.push_back({{"id", number}, {"name", part.name}, {"form", form(part)}});
    }
    list.push_back({{"id", list.size()},
                    {"name", entity.name},
                    {"owner", name_of(entity.owner)},
                    {"kind", entity.owner == BodyOwner::building ? "door" : to_string(entity.kind)},
                    {"robot_model", model_of(entity.name)},
                    {"parts", std::move(parts)}});
  }
  return text_of({{"type", "entities"},
                  {"table", table.number()},
                  {"forms", std::move(forms)},
                  {"list", std::move(list)}});
}

std::string events_json(std::span<const Event> events, SimulationTime start) {
  Json list = Json::array();
  for (const Event& event : events) list.push_back(event_json(event, start));
  return text_of({{"type", "events"}, {"list", std::move(list)}});
}

std::string score_json(const ScoreBoard& board, SimulationTime start, SimulationTime now) {
  Json tasks = Json::array(), penalties = Json::array();
  for (const TaskLine& task : board.tasks()) {
    const auto left = board.left(task, now);
    tasks.push_back({{"name", task.name},
                     {"title", task.text},
                     {"state", to_string(task.state)},
                     {"required", task.required},
                     {"points", rounded(task.points)},
                     {"of", rounded(task.of)},
                     {"left_s", left ? rounded(*left) : Json()}});
  }
  for (const PenaltyLine& penalty : board.penalties())
    penalties.push_back(
        {{"name", penalty.name}, {"count", penalty.count}, {"points", rounded(penalty.points)}});
  Json left, began;
  const auto clock = board.began(start);
  if (clock) began = rounded((*clock - start).seconds());
  if (board.limit() && !board.verdict())
    left = rounded(clock ? std::max(0.0, *board.limit() - (now - *clock).seconds()) : *board.limit());
  return text_of({{"type", "score"},
                  {"graded", board.graded()},
                  {"score", rounded(board.score())},
                  {"possible", rounded(board.possible())},
                  {"awarded", rounded(board.awarded())},
                  {"deducted", rounded(board.deducted())},
                  {"penalties", std::move(penalties)},
                  {"waiting", board.waiting()},
                  {"began", began},
                  {"pass_mark", rounded(board.pass_mark())},
                  {"ended", board.verdict().has_value()},
                  {"verdict", board.verdict().value_or("")},
                  {"passed", board.verdict() ? Json(board.passed()) : Json()},
                  {"tasks", std::move(tasks)},
                  {"left_s", left}});
}

std::string status_json(const ServerStatus& status, const std::vector<SensorState>& sensors) {
  Json values = Json::object(), notes = Json::object(), list = Json::array();
  for (const auto& [name, value] : status.values) values[name] = rounded(value);
  for (const auto& [name, note] : status.notes) notes[name] = note;
  for (const SensorState& sensor : sensors) {
    const bool received = sensor.status != SensorState::Health::none;
    list.push_back({{"name", sensor.name},
                    {"rate_hz", rounded(sensor.rate)},
                    {"age_ms", received ? Json(std::round(sensor.age * 1e3)) : Json()},
                    {"loss", rounded(sensor.loss)},
                    {"state", to_string(sensor.status)}});
  }
  return text_of({{"type", "status"},
                  {"values", std::move(values)},
                  {"notes", std::move(notes)},
                  {"sensors", std::move(list)}});
}

std::string injection_json(const ScanInfo& info) {
  return text_of({{"type", "injection"},
                  {"live", info.live},
                  {"reason", info.reason},
                  {"predicted_error", rounded(info.predicted_error)}});
}

std::string pose_json(const PoseEstimate& estimate) {
  const double variance = std::max(estimate.covariance(0, 0), estimate.covariance(1, 1));
  const bool tracking = estimate.state == SlamState::tracking;
  return text_of({{"type", "pose"},
                  {"state", to_string(estimate.state)},
                  {"sigma_m", tracking && variance >= 0 ? rounded(std::sqrt(variance)) : Json()}});
}

std::string robots_json(std::span<const RobotLine> robots) {
  Json list = Json::array();
  for (const RobotLine& robot : robots) {
    list.push_back({{"name", robot.name},
                    {"localized", robot.localized},
                    {"silent_s", robot.silent_s ? rounded(*robot.silent_s) : Json()},
                    {"injecting", robot.injecting},
                    {"reason", robot.reason},
                    {"score", robot.score ? rounded(*robot.score) : Json()}});
  }
  return text_of({{"type", "robots"}, {"list", std::move(list)}});
}

std::string operators_json(std::span<const OperatorStatus> statuses) {
  static constexpr const char* states[] = {"drives", "ended", "lost"};
  Json list = Json::array();
  for (const OperatorStatus& status : statuses)
    list.push_back({{"name", status.name},
                    {"robot", status.robot},
                    {"state", states[static_cast<std::size_t>(status.state)]},
                    {"console", status.text}});
  return text_of({{"type", "operators"}, {"list", std::move(list)}});
}

std::string known_json(const runtime::KnownWorld& world, SimulationTime start) {
  if (world.things.empty()) return {};
  Json list = Json::array();
  for (const auto& [name, thing] : world.things) {
    list.push_back({{"name", name},
                    {"t", rounded((thing.sensed - start).seconds())},
                    {"by", to_string(thing.by)},
                    {"now", thing.now}});
  }
  return text_of({{"type", "known"}, {"list", std::move(list)}});
}

std::string control_json(const ControlState& state) {
  return text_of({{"type", "control"},
                  {"mode", state.recorded ? "recorded" : "live"},
                  {"paused", state.paused},
                  {"rate", rounded(state.rate)},
                  {"position", rounded(state.position)},
                  {"duration", state.duration < 0 ? Json() : rounded(state.duration)},
                  {"ended", state.ended},
                  {"frozen", state.frozen},
                  {"estop", state.estop},
                  {"clock", rounded(state.clock)}});
}

std::string hazard_json(const HazardReading& reading, double t) {
  Json list = Json::array();
  for (const HazardReading::Value& value : reading.values)
    list.push_back({{"kind", to_string(value.kind)}, {"value", rounded(value.value)}, {"unit", value.unit}});
  return text_of({{"type", "hazard"}, {"t", rounded(t)}, {"values", std::move(list)}});
}

std::string joints_json(const std::string& robot, const Joints& joints) {
  Json positions = Json::array();
  for (const double position : joints.positions) positions.push_back(rounded(position));
  return text_of(
      {{"type", "joints"}, {"robot", robot}, {"names", joints.names}, {"positions", std::move(positions)}});
}

std::string zones_json(std::span<const Zone> zones) {
  Json list = Json::array();
  for (const Zone& zone : zones) {
    Json points = Json::array();
    for (const Eigen::Vector2d& corner : zone.outline)
      points.push_back({rounded(corner.x()), rounded(corner.y())});
    list.push_back({{"name", zone.name},
                    {"points", std::move(points)},
                    {"bottom", rounded(zone.bottom)},
                    {"top", rounded(zone.top)}});
  }
  return text_of({{"type", "zones"}, {"list", std::move(list)}});
}

std::string model_json(std::uint64_t version) { return text_of({{"type", "model"}, {"version", version}}); }

std::string reply_json(std::uint64_t request, const Status& done, const std::string& text) {
  return text_of({{"type", "reply"},
                  {"request", request},
                  {"ok", done.ok()},
                  {"text", done.ok() ? text : done.error().message}});
}

std::string plans_json(std::span<const EntityPlan> plans) {
  Json list = Json::array();
  for (const EntityPlan& plan : plans) {
    Json points = Json::array();
    for (const Eigen::Vector2d& point : plan.points)
      points.push_back({rounded(point.x()), rounded(point.y())});
    list.push_back({{"entity", plan.entity}, {"kind", plan.kind}, {"points", std::move(points)}});
  }
  return text_of({{"type", "plans"}, {"list", std::move(list)}});
}

std::string chat_json(const ChatLine& line) {
  Json chat{{"type", "chat"},
            {"t", rounded(line.t)},
            {"from", line.from},
            {"role", role_name(line.role)},
            {"text", line.text}};
  if (line.to_role) chat["to_role"] = role_name(*line.to_role);
  if (!line.to_person.empty()) chat["to_person"] = line.to_person;
  return text_of(chat);
}

std::string mark_json(const MarkLine& line) {
  return text_of({{"type", "mark"}, {"t", rounded(line.t)}, {"by", line.by}, {"text", line.text}});
}

}  // namespace parhelion::station
