#include "server/station/site_json.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "protocols/door.hpp"
#include "protocols/site_texture.hpp"
#include "server/runtime/knowledge.hpp"
#include "server/training/briefing.hpp"

namespace parhelion::station {
namespace {

using Json = nlohmann::json;

Json rounded(double value) {
  if (!std::isfinite(value)) return nullptr;
  const double whole = std::round(value * 1e5) / 1e5;
  return whole == 0 ? 0 : whole;
}
Json triple(const auto& v) { return {rounded(v.x()), rounded(v.y()), rounded(v.z())}; }
Json quaternion(const Eigen::Quaterniond& q) {
  return {rounded(q.x()), rounded(q.y()), rounded(q.z()), rounded(q.w())};
}
Json pose(const auto& T) { return {{"at", triple(T.translation())}, {"turn", quaternion(T.quaternion())}}; }
Json outline(const auto& corners) {
  Json list = Json::array();
  for (const auto& corner : corners) list.push_back({rounded(corner.x()), rounded(corner.y())});
  return list;
}
std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

/// The choices of an instructor, and the briefing; a trainee is shown this alone, without values that were
/// drawn.
Json scene_json(const tick::Configuration& configuration, bool trainee) {
  if (trainee)
    return {{"scripts", Json::array()},
            {"faults", Json::array()},
            {"doors", Json::array()},
            {"robot_models", Json::array()},
            {"briefing", runtime::trainee_briefing(configuration)}};
  const Scenario& scenario = configuration.scenario;
  Json scripts = Json::array(), faults = Json::array(), doors = Json::array(), models = Json::array();
  for (const Script& script : scenario.scripts) scripts.push_back(script.name);
  for (int i = 0; i <= static_cast<int>(Fault::Kind::dead_wheel); ++i) {
    const auto kind = static_cast<Fault::Kind>(i);
    const bool possible = !needs_simulated_robot(kind) || tick::simulates_trainee(scenario);
    if (possible && kind != Fault::Kind::low_battery) faults.push_back(to_string(kind));
  }
  for (const ModelEntity& entity : configuration.model.entities) {
    if (entity.label == EntityLabel::door && !entity.deleted) doors.push_back(entity.name);
  }
  for (const auto& model : configuration.robot_models) models.push_back(model->name);
  return {{"scripts", std::move(scripts)},
          {"faults", std::move(faults)},
          {"doors", std::move(doors)},
          {"robot_models", std::move(models)},
          {"agents_max", scenario.max_agents},
          {"briefing",
           scenario.training ? training::briefing(scenario, tick::graded_robots(configuration)) : ""}};
}

Json shape_json(const Shape& shape) {
  // The model's drawing beside the joints shows a mesh by its bounding box.
  static constexpr const char* kinds[] = {"box", "cylinder", "sphere", "capsule", "box"};
  Json json = pose(shape.T_body_shape);
  json["shape"] = kinds[static_cast<std::size_t>(shape.kind)];
  json["size"] = triple(shape.size);
  json["colour"] = triple(shape.material.albedo);
  return json;
}

Json camera_json(const CameraIntrinsics& intrinsics, const auto& T_base_optical) {
  Json json = pose(T_base_optical);
  json.update({{"width", intrinsics.width},
               {"height", intrinsics.height},
               {"fx", rounded(intrinsics.fx)},
               {"fy", rounded(intrinsics.fy)},
               {"cx", rounded(intrinsics.cx)},
               {"cy", rounded(intrinsics.cy)}});
  return json;
}

Json description_json(const RobotDescription& robot) {
  Json json{{"name", robot.name},
            {"footprint", outline(robot.footprint)},
            {"height", rounded(robot.height)},
            {"mass", rounded(robot.mass)},
            {"speed", rounded(robot.limits.speed)},
            {"yaw_rate", rounded(robot.limits.yaw_rate)}};
  if (robot.laser) {
    json["laser"] = pose(robot.laser->T_base_laser);
    json["laser"]["range_min"] = rounded(robot.laser->convention.range_min);
    json["laser"]["range_max"] = rounded(robot.laser->convention.range_max);
  }
  if (robot.camera) json["camera"] = camera_json(robot.camera->intrinsics, robot.camera->T_base_optical);
  if (robot.depth) json["depth"] = camera_json(robot.depth->intrinsics, robot.depth->T_base_optical);
  return json;
}

const char* word(simulation::JointKind kind) {
  static constexpr const char* names[] = {"fixed", "revolute", "continuous", "prismatic"};
  return names[static_cast<std::size_t>(kind)];
}

/// Links and joints as in URDF: a link's frame is its joint's.
void put_links(const simulation::RobotModel& model, Json& json) {
  Json& links = json["links"] = Json::array();
  for (const simulation::RobotLink& link : model.links) {
    Json visual = Json::array();
    for (const Shape& shape : link.visible) visual.push_back(shape_json(shape));
    links.push_back({{"name", link.name}, {"visual", std::move(visual)}});
  }
  Json& joints = json["joints"] = Json::array();
  for (const simulation::RobotJoint& joint : model.joints) {
    Json each = pose(joint.T_parent_child);
    each.update({{"name", joint.name},
                 {"kind", word(joint.kind)},
                 {"parent", model.links[joint.parent].name},
                 {"child", model.links[joint.child].name},
                 {"axis", triple(joint.axis)},
                 {"lower", rounded(joint.lower)},
                 {"upper", rounded(joint.upper)},
                 {"speed", rounded(joint.velocity)},
                 {"start", rounded(joint.start)}});
    joints.push_back(std::move(each));
  }
}

Json robot_names(const tick::Configuration& configuration) {
  Json names = Json::array();
  for (std::size_t i = 0; i < configuration.robot_count(); ++i)
    names.push_back(configuration.robot_at(i).name);
  return names;
}

/// True for the model of a robot that a trainee drives.
bool is_trainees(const tick::Configuration& configuration, const std::string& model) {
  const Scenario& scenario = configuration.scenario;
  return (scenario.trainee && scenario.trainee->model == model) ||
         std::any_of(scenario.agents.begin(), scenario.agents.end(), [&](const AgentDefinition& agent) {
           return agent.model == model && runtime::is_driven_by_trainees(configuration, agent);
         });
}

}  // namespace

std::string hello_json(const tick::Configuration& configuration, const Identity& who,
                       const HelloFields& hello_fields) {
  const Scenario& scenario = configuration.scenario;
  const bool trainee = who.role == Role::trainee;
  const Json marks = trainee ? Json() : Json::parse(hello_fields.marks, nullptr, false);
  return text_of({{"type", "hello"},
                  {"protocol", 1},
                  {"who", {{"name", who.name}, {"role", role_name(who.role)}}},
                  {"session",
                   {{"name", scenario.name},
                    {"scenario", scenario.name},
                    {"mode", hello_fields.recorded ? "recorded" : "live"},
                    {"level", scenario.level},
                    {"robot", configuration.robot.name},
                    {"robots", robot_names(configuration)},
                    {"graded", tick::graded_robot(configuration)},
                    {"simulated", tick::simulates_trainee(scenario)},
                    {"started_us", hello_fields.start.utime()},
                    {"mapped", hello_fields.mapped},
                    {"textured", hello_fields.textured}}},
                  {"server_us", hello_fields.now.utime()},
                  {"controls",
                   {{"pause", hello_fields.can_pause},
                    {"rate", hello_fields.can_rate},
                    {"seek", hello_fields.can_seek},
                    {"end", hello_fields.can_end},
                    {"save", hello_fields.can_save}}},
                  {"marks", marks.is_array() ? marks : Json::array()},
                  {"scene", scene_json(configuration, trainee)}});
}

std::string site_json(const SemanticModel& model, std::uint64_t version) {
  Json elements = Json::array(), meshes = Json::array();
  for (const ModelEntity& entity : model.entities) {
    if (entity.deleted) continue;
    Json each = pose(entity.T_map_body);
    each.update({{"name", entity.name},
                 {"label", to_string(entity.label)},
                 {"size", triple(entity.size)},
                 {"confidence", rounded(entity.confidence)},
                 {"observed", rounded(entity.observed)},
                 {"virtual", entity.is_virtual},
                 {"hinged", is_left_out_of_texture(entity)},
                 {"part_of", entity.part_of},
                 {"colour", triple(entity.material.albedo)}});
    elements.push_back(std::move(each));
  }
  for (const ModelMesh& mesh : model.meshes) {
    std::vector<double> vertices;
    std::vector<std::uint32_t> triangles;
    for (const Eigen::Vector3f& p : mesh.vertices) {
      for (const float coordinate : p) vertices.push_back(std::round(coordinate * 1e3) / 1e3);
    }
    for (const auto& corners : mesh.triangles)
      triangles.insert(triangles.end(), corners.begin(), corners.end());
    meshes.push_back(
        {{"name", mesh.name}, {"vertices", std::move(vertices)}, {"triangles", std::move(triangles)}});
  }
  return text_of({{"version", version},
                  {"map_id", model.map_id},
                  {"elements", std::move(elements)},
                  {"meshes", std::move(meshes)}});
}

std::string robots_json(const tick::Configuration& configuration, bool for_trainee) {
  Json list = Json::array(), models = Json::array();
  Json own = description_json(configuration.robot);
  for (const auto& model : configuration.robot_models) {
    if (for_trainee && !is_trainees(configuration, model->name)) continue;
    Json each = description_json(model->description);
    each["name"] = model->name;
    put_links(*model, each);
    const auto& trainee = configuration.scenario.trainee;
    if (trainee && trainee->model == model->name) {
      put_links(*model, own);
      own["model"] = model->name;
    }
    models.push_back(std::move(each));
  }
  list.push_back(std::move(own));
  for (const RobotDescription& other : configuration.other_robots) list.push_back(description_json(other));
  return text_of({{"robots", std::move(list)}, {"models", std::move(models)}});
}

}  // namespace parhelion::station
