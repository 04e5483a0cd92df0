// parse(to_yaml(x)) == x, to the bit, for any x that is valid.
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cmath>

#include "protocols/model.hpp"
#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"

namespace parhelion {
namespace {

/// Any finite double, by its bits, or a short decimal as people write it.
double finite() {
  if (*rc::gen::arbitrary<bool>()) return *rc::gen::inRange(-100'000, 100'000) / 1000.0;
  const double value = std::bit_cast<double>(*rc::gen::arbitrary<std::uint64_t>());
  return std::isfinite(value) ? value : 0.1;
}
double positive() {
  const double value = std::abs(finite());
  return value > 0 ? value : 1;
}
/// In [low, high].
double between(double low, double high) {
  return low + (high - low) * (*rc::gen::inRange<std::int64_t>(0, (1LL << 53) + 1) * 0x1p-53);
}
float between_floats(double low, double high) { return static_cast<float>(between(low, high)); }
template <class Enum>
Enum any_of(int count) {
  return static_cast<Enum>(*rc::gen::inRange(0, count));
}

std::string text() {
  std::string out;
  for (const char c : *rc::gen::string<std::string>()) {
    if (static_cast<unsigned char>(c) < 0x80) out += c;
  }
  const std::vector<std::string> texts{
      out, "null", "~", "true", "3", "- a", "a: b", "\xc3\xa9\xe2\x82\xac", " x ", "#", "\'", "", "a: &b *c"};
  return *rc::gen::elementOf(texts);
}

template <class A, class B>
Transform<A, B> upright() {
  return Transform<A, B>::planar(finite(), finite(), between(-4, 4), finite());
}
template <class A, class B>
Transform<A, B> any_pose() {
  if (*rc::gen::arbitrary<bool>()) return upright<A, B>();
  Eigen::Quaterniond q(between(-1, 1), between(-1, 1), between(-1, 1), between(-1, 1));
  if (q.norm() < 0.01) q = Eigen::Quaterniond(0, 0, 0, 1);
  return {q, {finite(), finite(), finite()}};
}

template <class A, class B>
bool same(const Transform<A, B>& a, const Transform<A, B>& b) {
  return a.isometry().matrix() == b.isometry().matrix();
}

ModelMesh any_mesh() {
  ModelMesh mesh;
  mesh.name = "mesh" + text();
  const int vertices = *rc::gen::inRange(0, 40);
  for (int i = 0; i < vertices; ++i)
    mesh.vertices.emplace_back(between_floats(-1e6, 1e6), between_floats(-9, 9), between_floats(-1e-9, 1));
  for (int i = vertices == 0 ? 0 : *rc::gen::inRange(0, 40); i > 0; --i) {
    const auto vertex = [&] { return static_cast<std::uint32_t>(*rc::gen::inRange(0, vertices)); };
    mesh.triangles.push_back({vertex(), vertex(), vertex()});
  }
  return mesh;
}

Behaviour any_behaviour() {
  Behaviour behaviour;
  behaviour.kind = any_of<BehaviourKind>(static_cast<int>(kLastBehaviourKind) + 1);
  behaviour.speed = positive();
  for (int k = *rc::gen::inRange(1, 4); k > 0; --k) behaviour.waypoints.push_back({finite(), finite()});
  behaviour.target = text();
  behaviour.distance = positive();
  behaviour.yields = *rc::gen::arbitrary<bool>();
  behaviour.opens_doors = *rc::gen::arbitrary<bool>();
  return behaviour;
}

AgentDefinition any_agent(int number) {
  AgentDefinition agent;
  agent.name = "Agent_" + std::to_string(number) + "-x";
  agent.kind = any_of<AgentKind>(4);
  agent.T_map_base = upright<Map, Base>();
  agent.size = {between(1e-3, 9e3), between(1e-3, 9e3), between(1e-3, 9e3)};
  agent.behaviour = any_behaviour();
  agent.laser = text();
  if (agent.kind == AgentKind::robot) agent.model = text();
  return agent;
}

void expect_same(const Behaviour& x, const Behaviour& y) {
  RC_ASSERT(x.kind == y.kind && x.speed == y.speed && x.waypoints == y.waypoints);
  RC_ASSERT(x.target == y.target && x.distance == y.distance);
  RC_ASSERT(x.yields == y.yields && x.opens_doors == y.opens_doors);
}

ScriptTrigger any_trigger() {
  using Kind = ScriptTrigger::Kind;
  ScriptTrigger when;
  when.kind = any_of<Kind>(3);
  if (when.kind == Kind::time) {
    when.time = positive();
    return when;
  }
  when.subject = kTrainee;
  when.object = when.kind == Kind::near ? "Agent_1-x" : "door " + text();
  if (when.kind == Kind::near) when.distance = positive();
  if (when.kind == Kind::event) when.event = any_of<EventKind>(static_cast<int>(kLastEventKind) + 1);
  return when;
}

Script any_script(int number) {
  using Action = AgentCommand::Action;
  Script script;
  script.name = "script " + std::to_string(number) + text();
  script.when = any_trigger();
  script.after = positive();
  script.repeat = *rc::gen::arbitrary<bool>();
  for (int k = *rc::gen::inRange(1, 4); k > 0; --k) {
    AgentCommand& command = script.actions.emplace_back();
    command.action = any_of<Action>(7);
    if (command.action == Action::spawn) command.agent = any_agent(9);
    if (command.action != Action::remove_all) command.agent.name = "Agent_1-x";
    if (command.action == Action::behave) command.agent.behaviour = any_behaviour();
    if (command.action == Action::move) command.agent.T_map_base = upright<Map, Base>();
  }
  return script;
}

void expect_same(const Script& x, const Script& y) {
  RC_ASSERT(x.name == y.name && x.after == y.after && x.repeat == y.repeat);
  RC_ASSERT(x.when.kind == y.when.kind && x.when.time == y.when.time && x.when.event == y.when.event);
  RC_ASSERT(x.when.subject == y.when.subject && x.when.object == y.when.object);
  RC_ASSERT(x.when.distance == y.when.distance && x.actions.size() == y.actions.size());
  for (std::size_t i = 0; i < x.actions.size(); ++i) {
    RC_ASSERT(x.actions[i].action == y.actions[i].action);
    RC_ASSERT(x.actions[i].agent.name == y.actions[i].agent.name);
    RC_ASSERT(same(x.actions[i].agent.T_map_base, y.actions[i].agent.T_map_base));
    expect_same(x.actions[i].agent.behaviour, y.actions[i].agent.behaviour);
  }
}

RC_GTEST_PROP(RoundTrip, Scenario, ()) {
  Scenario a;
  a.name = text();
  a.level = *rc::gen::inRange(1, 4);
  a.seed = *rc::gen::arbitrary<std::uint64_t>();
  a.physics_rate = between(10, 10'000);
  a.model = text();
  a.robot = text();
  a.mapping = *rc::gen::arbitrary<bool>();
  a.most_agents = static_cast<std::uint64_t>(*rc::gen::inRange(1, 10'001));
  a.injection.max_error = positive();
  a.injection.restore = between(0, 1);
  a.contact.stop_distance = between(0, 1);
  a.contact.slow_distance = between(1.5, 3);
  a.contact.crawl_speed = positive();
  a.contact.silence = positive();
  if (*rc::gen::arbitrary<bool>())
    a.trainee = Trainee{"me", "m" + text(), upright<Map, Base>(), *rc::gen::arbitrary<bool>()};
  if (*rc::gen::arbitrary<bool>()) a.pose = PoseInput{positive(), positive(), text()};
  for (int i = *rc::gen::inRange(0, 5); i > 0; --i) {
    const AgentDefinition agent = any_agent(i);
    a.agents.push_back(agent);
  }
  if (!a.agents.empty()) {
    for (int i = *rc::gen::inRange(0, 4); i > 0; --i) a.scripts.push_back(any_script(i));
  }
  if (*rc::gen::arbitrary<bool>()) a.channels = {{"SCAN", "a/b"}, {"MR_SCAN", "null"}, {"CAMERA", "7"}};

  const auto b = parse_scenario(to_yaml(a), "s.yaml");
  RC_ASSERT(b.ok());
  RC_ASSERT(b->name == a.name);
  RC_ASSERT(b->level == a.level);
  RC_ASSERT(b->seed == a.seed);
  RC_ASSERT(b->physics_rate == a.physics_rate);
  RC_ASSERT(b->model == a.model);
  RC_ASSERT(b->mapping == a.mapping);
  RC_ASSERT(b->most_agents == a.most_agents);
  RC_ASSERT(b->robot == a.robot);
  RC_ASSERT(b->injection.max_error == a.injection.max_error);
  RC_ASSERT(b->injection.restore == a.injection.restore);
  RC_ASSERT(b->contact.slow_distance == a.contact.slow_distance);
  RC_ASSERT(b->contact.stop_distance == a.contact.stop_distance);
  RC_ASSERT(b->contact.crawl_speed == a.contact.crawl_speed);
  RC_ASSERT(b->contact.silence == a.contact.silence);
  RC_ASSERT(b->channels == a.channels);
  RC_ASSERT(b->trainee.has_value() == a.trainee.has_value());
  if (a.trainee) {
    RC_ASSERT(b->trainee->name == a.trainee->name && b->trainee->model == a.trainee->model);
    RC_ASSERT(b->trainee->slam == a.trainee->slam && same(b->trainee->T_map_base, a.trainee->T_map_base));
  }
  RC_ASSERT(b->pose.has_value() == a.pose.has_value());
  if (a.pose) {
    RC_ASSERT(b->pose->position_sigma == a.pose->position_sigma && b->pose->yaw_sigma == a.pose->yaw_sigma);
    RC_ASSERT(b->pose->map_id == a.pose->map_id);
  }
  RC_ASSERT(b->agents.size() == a.agents.size());
  for (std::size_t i = 0; i < a.agents.size(); ++i) {
    const AgentDefinition &x = a.agents[i], &y = b->agents[i];
    RC_ASSERT(x.name == y.name && x.kind == y.kind && x.laser == y.laser && x.model == y.model);
    RC_ASSERT(same(x.T_map_base, y.T_map_base));
    RC_ASSERT(x.size == y.size);
    expect_same(x.behaviour, y.behaviour);
  }
  RC_ASSERT(b->scripts.size() == a.scripts.size());
  for (std::size_t i = 0; i < a.scripts.size(); ++i) expect_same(a.scripts[i], b->scripts[i]);
}

RC_GTEST_PROP(RoundTrip, Model, ()) {
  SemanticModel a;
  a.map_id = text();
  a.source = text();
  for (int i = *rc::gen::inRange(0, 6); i > 0; --i) {
    ModelEntity entity;
    entity.name = "wall " + std::to_string(i);
    entity.label = any_of<EntityLabel>(10);
    entity.T_map_body = any_pose<Map, Body>();
    // Far apart from the others, so that none overlap.
    auto place = entity.T_map_body.isometry();
    place.translation().z() = 1e5 * i;
    entity.T_map_body = Transform<Map, Body>(place);
    entity.size = {between(1e-3, 9e3), between(1e-3, 9e3), between(1e-3, 9e3)};
    entity.confidence = between(0, 1);
    entity.is_virtual = *rc::gen::arbitrary<bool>();
    entity.material.albedo = {between_floats(0, 1), between_floats(0, 1), between_floats(0, 1)};
    entity.material.roughness = between_floats(0, 1);
    entity.material.metallic = between_floats(0, 1);
    entity.material.laser_reflectivity = between_floats(0, 1);
    entity.part_of = text();
    if (entity.label == EntityLabel::door && *rc::gen::arbitrary<bool>()) {
      const double lower = between(-6, 6);
      const double upper = between(lower, 6);
      entity.hinge = {{finite(), finite()}, lower, upper, between(lower, upper)};
    }
    entity.observed = between(0, 1);
    entity.locked = *rc::gen::arbitrary<bool>();
    entity.deleted = *rc::gen::arbitrary<bool>();
    a.entities.push_back(entity);
  }
  for (std::size_t i = 1; i < a.entities.size(); ++i) {
    a.relations.push_back(
        {any_of<RelationKind>(7), a.entities[i].name, a.entities[i - 1].name, between(0, 1)});
  }
  for (int i = *rc::gen::inRange(0, 3); i > 0; --i) a.meshes.push_back(any_mesh());
  a.T_map_cloud = any_pose<Map, Cloud>();
  const auto b = parse_model(to_yaml(a), "m.yaml");
  RC_ASSERT(b.ok());
  RC_ASSERT(same(b->T_map_cloud, a.T_map_cloud));
  RC_ASSERT(b->relations.size() == a.relations.size());
  for (std::size_t i = 0; i < a.relations.size(); ++i) {
    const Relation &x = a.relations[i], &y = b->relations[i];
    RC_ASSERT(x.kind == y.kind && x.from == y.from && x.to == y.to && x.confidence == y.confidence);
  }
  RC_ASSERT(b->meshes.size() == a.meshes.size());
  for (std::size_t i = 0; i < a.meshes.size(); ++i) {
    RC_ASSERT(b->meshes[i].name == a.meshes[i].name && b->meshes[i].vertices == a.meshes[i].vertices);
    RC_ASSERT(b->meshes[i].triangles == a.meshes[i].triangles);
  }
  RC_ASSERT(b->map_id == a.map_id && b->source == a.source);
  RC_ASSERT(b->entities.size() == a.entities.size());
  for (std::size_t i = 0; i < a.entities.size(); ++i) {
    const ModelEntity &x = a.entities[i], &y = b->entities[i];
    RC_ASSERT(x.name == y.name && x.label == y.label && x.is_virtual == y.is_virtual);
    RC_ASSERT(same(x.T_map_body, y.T_map_body));
    RC_ASSERT(x.size == y.size && x.confidence == y.confidence);
    RC_ASSERT(x.material.albedo == y.material.albedo);
    RC_ASSERT(x.material.roughness == y.material.roughness && x.material.metallic == y.material.metallic);
    RC_ASSERT(x.material.laser_reflectivity == y.material.laser_reflectivity);
    RC_ASSERT(x.part_of == y.part_of && x.observed == y.observed);
    RC_ASSERT(x.locked == y.locked && x.deleted == y.deleted);
    RC_ASSERT(x.hinge.has_value() == y.hinge.has_value());
    if (x.hinge) {
      RC_ASSERT(x.hinge->axis == y.hinge->axis);
      RC_ASSERT(x.hinge->lower == y.hinge->lower && x.hinge->upper == y.hinge->upper);
      RC_ASSERT(x.hinge->closed == y.hinge->closed);
    }
  }
}

LaserDescription any_laser() {
  using Sentinel = RangeConvention::Sentinel;
  LaserDescription laser;
  laser.preset = text();
  laser.T_base_laser = any_pose<Base, Laser>();
  laser.convention.range_min = between_floats(0, 1);
  laser.convention.range_max = between_floats(1.5, 90'000);
  laser.convention.no_return = any_of<Sentinel>(3);
  laser.convention.too_close = any_of<Sentinel>(3);
  if (laser.convention.no_return == Sentinel::value)
    laser.convention.no_return_value = between_floats(-1, 100);
  if (laser.convention.too_close == Sentinel::value) laser.convention.too_close_value = between_floats(-1, 1);
  laser.stamp_beam = any_of<LaserDescription::StampBeam>(3);
  laser.passes = *rc::gen::inRange(1, 65);
  laser.pass_period = between(0, 1);
  laser.beam_interval = between(0, 1e-3);
  laser.scan_period = between(0, 3);
  laser.noise_sigma = between(0, 1);
  laser.quantization = between(0, 1);
  laser.intensity_scale = between(0.001, 70'000);
  laser.intensities = *rc::gen::arbitrary<bool>();
  laser.beams = *rc::gen::inRange(0, 100'001);
  laser.angle_first = finite();
  laser.angle_step = positive();
  laser.source = text();
  return laser;
}

bool same(const LaserDescription& a, const LaserDescription& b) {
  const RangeConvention &x = a.convention, &y = b.convention;
  return a.preset == b.preset && same(a.T_base_laser, b.T_base_laser) && x.range_min == y.range_min &&
         x.range_max == y.range_max && x.no_return == y.no_return && x.too_close == y.too_close &&
         x.no_return_value == y.no_return_value && x.too_close_value == y.too_close_value &&
         a.stamp_beam == b.stamp_beam && a.passes == b.passes && a.pass_period == b.pass_period &&
         a.beam_interval == b.beam_interval && a.scan_period == b.scan_period &&
         a.noise_sigma == b.noise_sigma && a.quantization == b.quantization &&
         a.intensity_scale == b.intensity_scale && a.intensities == b.intensities && a.beams == b.beams &&
         a.angle_first == b.angle_first && a.angle_step == b.angle_step && a.source == b.source;
}

CameraIntrinsics any_intrinsics() {
  CameraIntrinsics camera;
  camera.width = *rc::gen::inRange(1, 65'537);
  camera.height = *rc::gen::inRange(1, 65'537);
  camera.fx = positive();
  camera.fy = positive();
  camera.cx = finite();
  camera.cy = finite();
  camera.lens = any_of<CameraIntrinsics::Lens>(2);
  const bool fisheye = camera.lens == CameraIntrinsics::Lens::fisheye;
  for (std::size_t i = 0; i < (fisheye ? 4 : 5); ++i) camera.distortion.at(i) = finite();
  return camera;
}

bool same(const CameraIntrinsics& a, const CameraIntrinsics& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx &&
         a.cy == b.cy && a.lens == b.lens && a.distortion == b.distortion;
}

std::vector<HeadJoint> any_head() {
  std::vector<HeadJoint> head;
  for (int i = *rc::gen::inRange(0, 3); i > 0; --i) {
    const double angle = between(-3, 3);
    head.push_back({"joint " + std::to_string(i),
                    {finite(), finite(), finite()},
                    {std::cos(angle), 0, std::sin(angle)}});
  }
  return head;
}

bool same(const std::vector<HeadJoint>& a, const std::vector<HeadJoint>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const HeadJoint& x, const HeadJoint& y) {
    return x.joint == y.joint && x.point == y.point && x.axis == y.axis;
  });
}

RC_GTEST_PROP(RoundTrip, RobotDescription, ()) {
  RobotDescription a;
  a.name = text();
  if (*rc::gen::arbitrary<bool>()) a.laser = any_laser();
  if (*rc::gen::arbitrary<bool>()) a.line_laser = LineLaserDescription{any_laser(), any_head()};
  if (*rc::gen::arbitrary<bool>()) {
    a.camera = CameraDescription{any_intrinsics(),
                                 any_pose<Base, CameraOptical>(),
                                 any_head(),
                                 between(0, 60),
                                 between(0, 100),
                                 between(0, 50),
                                 text()};
  }
  if (*rc::gen::arbitrary<bool>()) {
    a.depth = DepthCameraDescription{
        any_intrinsics(), any_pose<Base, DepthOptical>(), any_head(), between(0, 1), between(2, 9), text()};
  }
  if (*rc::gen::arbitrary<bool>()) a.imu = ImuDescription{any_pose<Base, Imu>()};
  if (*rc::gen::arbitrary<bool>()) a.footprint = {{0, 0}, {between(1, 2), 0}, {between(1, 2), between(1, 2)}};
  a.height = positive();
  a.mass = positive();
  a.limits = {positive(), positive(), positive(), positive()};
  a.velocity_frame = any_of<RobotDescription::VelocityFrame>(2);
  a.odometry_error_translation = positive();
  a.odometry_error_rotation = positive();
  a.source = text();

  const auto b = parse_robot_description(to_yaml(a), "r.yaml");
  RC_ASSERT(b.ok());
  RC_ASSERT(a.name == b->name && a.source == b->source);
  RC_ASSERT(a.laser.has_value() == b->laser.has_value());
  if (a.laser) RC_ASSERT(same(*a.laser, *b->laser));
  RC_ASSERT(a.line_laser.has_value() == b->line_laser.has_value());
  if (a.line_laser) {
    RC_ASSERT(same(a.line_laser->laser, b->line_laser->laser));
    RC_ASSERT(same(a.line_laser->head, b->line_laser->head));
  }
  RC_ASSERT(a.camera.has_value() == b->camera.has_value());
  if (a.camera) {
    RC_ASSERT(same(a.camera->intrinsics, b->camera->intrinsics));
    RC_ASSERT(same(a.camera->T_base_optical, b->camera->T_base_optical));
    RC_ASSERT(same(a.camera->head, b->camera->head));
    RC_ASSERT(a.camera->readout == b->camera->readout && a.camera->source == b->camera->source);
    RC_ASSERT(a.camera->rate == b->camera->rate && a.camera->noise == b->camera->noise);
  }
  RC_ASSERT(a.depth.has_value() == b->depth.has_value());
  if (a.depth) {
    RC_ASSERT(same(a.depth->intrinsics, b->depth->intrinsics));
    RC_ASSERT(same(a.depth->T_base_optical, b->depth->T_base_optical));
    RC_ASSERT(same(a.depth->head, b->depth->head));
    RC_ASSERT(a.depth->range_min == b->depth->range_min && a.depth->range_max == b->depth->range_max);
    RC_ASSERT(a.depth->source == b->depth->source);
  }
  RC_ASSERT(a.imu.has_value() == b->imu.has_value());
  if (a.imu) RC_ASSERT(same(a.imu->T_base_imu, b->imu->T_base_imu));
  RC_ASSERT(a.footprint == b->footprint);
  RC_ASSERT(a.height == b->height && a.mass == b->mass);
  RC_ASSERT(a.limits.speed == b->limits.speed && a.limits.yaw_rate == b->limits.yaw_rate);
  RC_ASSERT(a.limits.deceleration == b->limits.deceleration &&
            a.limits.reaction_time == b->limits.reaction_time);
  RC_ASSERT(a.velocity_frame == b->velocity_frame);
  RC_ASSERT(a.odometry_error_translation == b->odometry_error_translation);
  RC_ASSERT(a.odometry_error_rotation == b->odometry_error_rotation);
}

TEST(RoundTrip, AnglesThatPeopleWriteStayAsTheyWroteThem) {
  const auto model = parse_model(
      "entities:\n  - {name: w, label: wall, pose: {x: 1 m, yaw: 33.5 deg}, size: [1 m, 1 m, 1 m]}", "m");
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_NE(to_yaml(*model).find("pose: {x: 1 m, y: 0 m, yaw: 33.5 deg}"), std::string::npos)
      << to_yaml(*model);
}

}  // namespace
}  // namespace parhelion
