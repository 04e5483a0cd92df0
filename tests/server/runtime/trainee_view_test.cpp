// What trainees may be named, by what their robots have sensed.
#include "server/runtime/trainee_view.hpp"

#include <gmock/gmock.h>

#include "server/simulation/bodies/bodies.hpp"
#include "tests/model_box.hpp"
#include "tests/server/tick/synthetic.hpp"

namespace parhelion::runtime {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// A robot at the origin that looks along x, past a wall at y = 1 that reaches from x = 1 to 5.
class TraineeViewTest : public ::testing::Test {
 protected:
  TraineeViewTest() {
    Scenario scenario;
    scenario.agents = {agent("barrel_1", AgentKind::barrel), agent("crate_1", AgentKind::box),
                       agent("person_1", AgentKind::person), agent("screen_1", AgentKind::box)};
    scenario.agents.back().size = {0.1, 3, 2};
    Training training;
    training.text = "Find barrel_1 from the far mark on. Stay away from person_1.";
    Task task;
    task.name = "find";
    task.done.kind = Condition::Kind::report;
    task.done.target = "barrel_1";
    training.tasks = {task};
    scenario.training = training;
    Zone named, hidden;
    named.name = "far mark";
    hidden.name = "ambush";
    scenario.zones = {named, hidden};
    SemanticModel model;
    model.entities.push_back(test::model_box("wall 1", EntityLabel::wall, {3, 1, 1.25}, {4, 0.1, 2.5}));
    RobotDescription robot = test::robot();
    robot.camera.emplace();
    robot.camera->intrinsics.width = robot.camera->intrinsics.height = 200;
    robot.camera->intrinsics.fx = robot.camera->intrinsics.fy = 100;
    robot.camera->intrinsics.cx = robot.camera->intrinsics.cy = 100;
    // z of the optical frame ahead, x right, y down.
    Eigen::Matrix3d R_base_optical;
    R_base_optical << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    robot.camera->T_base_optical =
        Transform<Base, CameraOptical>(Eigen::Quaterniond(R_base_optical), {0, 0, 0.5});
    auto made = tick::configure(scenario, robot, model);
    EXPECT_TRUE(made.ok()) << made.error().message;
    configuration_ = std::move(*made);
    shapes_.emplace(configuration_.scenario, configuration_.robot, configuration_.model,
                    configuration_.robot_models);
    knowledge_.emplace(configuration_, *shapes_);
    put(robot_, 0, 0, BodyOwner::real_robot);
  }
  static AgentDefinition agent(const std::string& name, AgentKind kind) {
    AgentDefinition made;
    made.name = name;
    made.kind = kind;
    return made;
  }
  /// Moves all bodies of the entity.
  void put(const std::string& entity, double x, double y, BodyOwner owner = BodyOwner::agent,
           AgentKind kind = AgentKind::box) {
    std::erase_if(world_.bodies, [&](const auto& body) { return body.entity == entity; });
    std::vector<BodyDefinition> bodies;
    if (const AgentDefinition* known = shapes_->definition(entity); known != nullptr)
      bodies = simulation::agent_bodies(*known, 1);
    if (bodies.empty()) bodies.resize(1);
    for (const BodyDefinition& body : bodies) {
      WorldMessage::Entry& entry = world_.bodies.emplace_back();
      entry.entity = entity;
      entry.part = bodies.size() == 1 && body.part.empty() ? "base" : body.part;
      entry.kind = kind;
      entry.owner = owner;
      entry.T_map_body = Transform<Map, Body>::planar(x, y, 0);
    }
  }
  void at(double t) { world_.stamp = SensorTime{1'000'000'000'000} + seconds(t); }
  void scan(const std::vector<std::string>& met) {
    ScanInfo info;
    info.live = true;
    info.agents = {"barrel_1", "crate_1", "person_1"};
    for (const std::string& name : met)
      info.beam_agent.push_back(static_cast<std::int16_t>(
          std::find(info.agents.begin(), info.agents.end(), name) - info.agents.begin()));
    knowledge_->handle_scan(info, 0, world_);
  }
  TraineeView view() const { return TraineeView(configuration_, *knowledge_, {robot_}); }
  std::vector<std::string> shown() const {
    std::vector<std::string> names;
    for (const auto& body : view().world(world_).message.bodies)
      if (names.empty() || names.back() != body.entity) names.push_back(body.entity);
    return names;
  }

  tick::Configuration configuration_ = test::configuration({});
  std::optional<simulation::EntityShapes> shapes_{std::in_place, configuration_.scenario,
                                                  configuration_.robot, configuration_.model,
                                                  configuration_.robot_models};
  std::optional<Knowledge> knowledge_;
  std::string robot_ = test::robot().name;
  WorldMessage world_;
};

TEST_F(TraineeViewTest, OnlyHisRobotIsShownBeforeAnythingIsSensed) {
  put("crate_1", 2, -1);
  EXPECT_THAT(shown(), ElementsAre(robot_));
}

TEST_F(TraineeViewTest, WhatABeamMetStaysWhereItWasSensedLast) {
  at(0);
  put("crate_1", 2, -1);
  scan({"crate_1"});
  EXPECT_THAT(shown(), ElementsAre(robot_, "object 1"));
  at(3);
  put("crate_1", 7, 7);
  const KnownWorld known = view().world(world_);
  EXPECT_EQ(known.message.bodies.back().T_map_body.translation().x(), 2);
  EXPECT_FALSE(known.things.at("object 1").now);
  EXPECT_EQ(known.things.at("object 1").sensed, SimulationTime{1'000'000'000'000});
  scan({"crate_1"});
  EXPECT_EQ(view().world(world_).message.bodies.back().T_map_body.translation().x(), 7);
}

TEST_F(TraineeViewTest, WhatIsRemovedOutOfSightStays) {
  put("crate_1", 2, -1);
  scan({"crate_1"});
  std::erase_if(world_.bodies, [](const auto& body) { return body.entity == "crate_1"; });
  EXPECT_THAT(shown(), ElementsAre(robot_, "object 1"));
}

/// An instructor's program adds and removes agents for a day: of the removed ones the last are known.
TEST_F(TraineeViewTest, WhatIsKnownOfRemovedAgentsIsBounded) {
  const auto happens = [&](EventKind kind, const std::string& subject) {
    Event event;
    event.kind = kind;
    event.subject = subject;
    knowledge_->take(event, world_);
  };
  const std::size_t of_scenario = knowledge_->agents().size();
  put("crate_1", 1, 0);
  happens(EventKind::agent_spawned, "crate_1");
  scan({"crate_1"});
  const std::size_t number = knowledge_->number_of("crate_1");
  for (int i = 0; i < 10'000; ++i) {
    happens(EventKind::agent_spawned, "box_" + std::to_string(i));
    happens(EventKind::agent_removed, "box_" + std::to_string(i));
    happens(EventKind::agent_removed, "again");  // one name, again and again
    happens(EventKind::agent_spawned, "again");
  }
  EXPECT_LE(knowledge_->agents().size(), of_scenario + 4096 + 2);
  EXPECT_TRUE(knowledge_->agents().contains("box_9999"));
  EXPECT_TRUE(knowledge_->agents().contains("again")) << "it is there";
  EXPECT_FALSE(knowledge_->agents().contains("box_0"));
  EXPECT_EQ(knowledge_->number_of("crate_1"), number) << "not removed";
  happens(EventKind::agent_removed, "barrel_1");
  for (int i = 0; i < 5000; ++i) happens(EventKind::agent_removed, "box_" + std::to_string(i));
  EXPECT_TRUE(knowledge_->agents().contains("barrel_1")) << "the scenario has it";
}

/// Of the removed ones the trainee reads no name, also when nothing else is kept of them.
TEST_F(TraineeViewTest, NamesOfForgottenAgentsStayHidden) {
  for (int i = 0; i < 10'000; ++i) {
    for (const EventKind kind : {EventKind::agent_spawned, EventKind::agent_removed}) {
      Event event;
      event.kind = kind;
      event.subject = "box_" + std::to_string(i);
      knowledge_->take(event, world_);
    }
  }
  const auto view = this->view();
  for (int i = 0; i < 10'000; i += 100) {
    const std::string box = "box_" + std::to_string(i);
    EXPECT_EQ(view.name_of(box), "") << box;
    EXPECT_EQ(view.text(box + ": near (" + box + "), not " + box + "-b"),
              "something: near (something), not " + box + "-b");
    Event event;
    event.kind = EventKind::near_miss;
    event.subject = robot_;
    event.object = box;
    EXPECT_FALSE(view.event(event)) << box;
    event.kind = EventKind::object_reported;
    event.text = "no " + box;
    const auto shown = view.event(event);
    ASSERT_TRUE(shown) << box;
    EXPECT_EQ(shown->text, "no something");
    EXPECT_EQ(shown->object, knowledge_->agents().contains(box) ? box : "something");
  }
  for (const ModelEntity& entity : configuration_.model.entities)
    EXPECT_EQ(view.name_of(entity.name), entity.name);
  EXPECT_EQ(view.name_of(robot_), robot_);
  EXPECT_EQ(view.text("the door of room 3"), "the door of room 3");
}

TEST_F(TraineeViewTest, ThePictureShowsWhatIsInViewAndNotHidden) {
  put("crate_1", 4, 0);
  put("barrel_1", 3, 2);   // behind the wall
  put("person_1", -3, 0);  // behind the robot
  knowledge_->handle_picture(0, world_);
  EXPECT_THAT(shown(), ElementsAre(robot_, "object 1"));
  put("barrel_1", 7, 0.2);  // past the crate, which is lower
  put("person_1", 3, -0.5);
  knowledge_->handle_picture(0, world_);
  EXPECT_THAT(shown(), ::testing::UnorderedElementsAre(robot_, "object 1", "object 2", "person_1"));
}

TEST_F(TraineeViewTest, WhatIsHiddenBehindAnotherAgentIsNotSeen) {
  put("screen_1", 2, 0);
  put("crate_1", 4, 0);
  knowledge_->handle_picture(0, world_);
  EXPECT_THAT(shown(), ElementsAre(robot_, "object 1"));
  EXPECT_EQ(view().name_of("crate_1"), "");
}

TEST_F(TraineeViewTest, AThingToBeFoundHasNoNameBeforeItIsReported) {
  put("barrel_1", 2, 0);
  scan({"barrel_1"});
  EXPECT_EQ(view().name_of("barrel_1"), "object 1");
  EXPECT_EQ(view().entity_of("object 1"), "barrel_1");
  Event report;
  report.kind = EventKind::object_reported;
  report.subject = robot_;
  report.object = "barrel_1";
  report.value = 0.3;
  knowledge_->take(report, world_);
  EXPECT_EQ(view().name_of("barrel_1"), "barrel_1");
  EXPECT_EQ(view().event(report)->value, -1) << "how far off he was would lead him there";
}

TEST_F(TraineeViewTest, WhomTheBriefingNamesIsNamedOnceSensed) {
  put("person_1", 2, 0);
  EXPECT_EQ(view().name_of("person_1"), "");
  scan({"person_1"});
  EXPECT_EQ(view().name_of("person_1"), "person_1");
}

TEST_F(TraineeViewTest, EventsOfWhatIsNotKnownAreLeftOut) {
  put("crate_1", 4, 0);
  Event near;
  near.kind = EventKind::near_miss;
  near.subject = robot_;
  near.object = "crate_1";
  EXPECT_FALSE(view().event(near));
  scan({"crate_1"});
  ASSERT_TRUE(view().event(near));
  EXPECT_EQ(view().event(near)->object, "object 1");
  Event of_others = near;
  of_others.subject = "person_1";
  EXPECT_FALSE(view().event(of_others));
  for (const EventKind kind : {EventKind::agent_spawned, EventKind::script_started, EventKind::fault_started,
                               EventKind::hazard_triggered, EventKind::command_accepted}) {
    near.kind = kind;
    EXPECT_FALSE(view().event(near)) << to_string(kind);
  }
}

TEST_F(TraineeViewTest, AContactIsFelt) {
  put("crate_1", -0.5, 0);
  Event contact;
  contact.kind = EventKind::contact_started;
  contact.subject = robot_;
  contact.object = "crate_1";
  knowledge_->take(contact, world_);
  EXPECT_THAT(shown(), ElementsAre(robot_, "object 1"));
  EXPECT_EQ(view().event(contact)->object, "object 1");
}

TEST_F(TraineeViewTest, TextsNameThingsAsHeKnowsThem) {
  put("crate_1", 2, 0);
  EXPECT_EQ(view().text("speed limited by crate_1"), "speed limited by something");
  EXPECT_EQ(view().text("crate_12 is another"), "crate_12 is another");
  scan({"crate_1"});
  EXPECT_EQ(view().text("contact_started " + robot_ + " - crate_1"),
            "contact_started " + robot_ + " - object 1");
}

TEST_F(TraineeViewTest, OnlyZonesOfTheBriefingAreDrawn) {
  ASSERT_EQ(view().zones().size(), 1U);
  EXPECT_EQ(view().zones().front().name, "far mark");
}

TEST_F(TraineeViewTest, WhatARobotSensedIsKnownToItsTraineesAlone) {
  put("crate_1", 2, 0);
  scan({"crate_1"});
  const TraineeView other(configuration_, *knowledge_, {"another robot"});
  EXPECT_THAT(other.name_of("crate_1"), IsEmpty());
  EXPECT_EQ(TraineeView(configuration_, *knowledge_, {"another robot", robot_}).name_of("crate_1"),
            "object 1");
}

}  // namespace
}  // namespace parhelion::runtime
