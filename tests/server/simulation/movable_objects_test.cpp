// Movable objects of a site's model: which become bodies, where they rest, and that robots push them.
#include "server/simulation/bodies/movable_objects.hpp"

#include "robots_world.hpp"
#include "tests/site_objects.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

const Eigen::Vector3d kChair{0.46, 0.44, 0.9}, kTable{1.6, 0.8, 0.74}, kBox{0.4, 0.4, 0.4};

std::vector<ModelObject> taken(const std::vector<ModelObject>& objects, SemanticModel model = room(8)) {
  auto bodies = take_movable(model, objects);
  EXPECT_TRUE(bodies) << (bodies ? "" : bodies.error().message);
  return bodies ? *bodies : std::vector<ModelObject>{};
}

std::vector<std::string> names(const std::vector<ModelObject>& objects) {
  std::vector<std::string> all;
  for (const ModelObject& object : objects) all.push_back(object.name);
  return all;
}

/// A room of 8 m with these objects, and a rover at (x, y) that looks along x.
Simulation with_rover(std::vector<ModelObject> objects, double x, double y) {
  SimulationOptions options = with_robots({"rover"});
  options.level = 1;
  options.objects = std::move(objects);
  Simulation simulation = make(room(8), options);
  const Status spawned = simulation.spawn_trainee(articulated("r", "rover", x, y));
  EXPECT_TRUE(spawned.ok()) << spawned.error().message;
  return simulation;
}

Eigen::Vector3d place_of(const Simulation& simulation, const std::string& entity) {
  return body(simulation, entity).T_map_body.translation();
}

/// Of a body's corner that moves the most in `duration` s, with what it is touched by.
double farthest_motion(Simulation& simulation, const std::string& entity, double duration,
                       const Twist2& twist = {}) {
  const Eigen::Vector3d start = place_of(simulation, entity);
  double farthest = 0;
  for (double t = 0; t < duration; t += 0.1) {
    drive(simulation, "r", twist, 0.1);
    farthest = std::max(farthest, (place_of(simulation, entity) - start).norm());
  }
  return farthest;
}

TEST(MovableObjects, AreTheMovableOnesOfReasonableSizeThatRestOnSomething) {
  ModelObject fixed = site_object("cupboard 1", ObjectKind::cupboard, 1, 3, {0.8, 0.4, 1.8});
  fixed.movable = false;
  const ModelObject huge = site_object("object 1", ObjectKind::object, -1, -2, {3.5, 1, 1});
  const ModelObject tiny = site_object("object 2", ObjectKind::object, 2, 2, {0.3, 0.3, 0.02});
  const ModelObject hanging = site_object("object 3", ObjectKind::object, 2, -2, kBox, 1.5);
  const ModelObject in_wall = site_object("box 2", ObjectKind::box, 4.1, 0, {0.4, 0.4, 0.4});
  const ModelObject named = site_object("wall 1", ObjectKind::box, 0, 2, kBox);
  const ModelObject chair = site_object("chair 1", ObjectKind::chair, 0, 0, kChair);
  ModelObject on_it = site_object("box 1", ObjectKind::box, 1.5, 0, {0.2, 0.2, 0.2}, kTable.z());
  on_it.on = "table 1";
  const ModelObject table = site_object("table 1", ObjectKind::table, 1.5, 0, kTable);
  const auto bodies = taken({fixed, huge, tiny, hanging, in_wall, named, chair, on_it, table});
  EXPECT_EQ(names(bodies), (std::vector<std::string>{"chair 1", "box 1", "table 1"})) << "in their order";
}

TEST(MovableObjects, TakeTheirMeshesOutOfTheModel) {
  SemanticModel model = room(8);
  const ModelObject chair = site_object("chair 1", ObjectKind::chair, 0, 0, kChair);
  ModelObject shelf = site_object("shelf 1", ObjectKind::shelf, 2, 2, {0.8, 0.3, 1.2});
  shelf.movable = false;
  model.meshes = {mesh_of(chair), mesh_of(shelf)};
  const auto bodies = take_movable(model, {chair, shelf});
  ASSERT_TRUE(bodies);
  ASSERT_EQ(model.meshes.size(), 1U);
  EXPECT_EQ(model.meshes[0].name, "shelf 1");
  ASSERT_EQ(bodies->size(), 1U);
  EXPECT_EQ(bodies->front().mesh.triangles, mesh_of(chair).triangles);
  const BodyDefinition body = object_body(bodies->front(), 7);
  ASSERT_EQ(body.shapes.size(), 1U);
  EXPECT_EQ(body.shapes[0].kind, ShapeKind::mesh);
  EXPECT_TRUE(body.shapes[0].size.isApprox(kChair, 1e-6)) << body.shapes[0].size.transpose();
  EXPECT_NEAR(body.shapes[0].T_body_shape.translation().z(), kChair.z() / 2, 1e-6);
}

TEST(MovableObjects, AreMovedOutOfFloorsAndWallsWithTheirMeshes) {
  SemanticModel model = room(8);  // walls from 4 m on
  const ModelObject sunk = site_object("box 1", ObjectKind::box, 0, 0, kBox, -0.02);
  const ModelObject in_wall = site_object("box 2", ObjectKind::box, 3.82, 0, kBox);
  model.meshes = {mesh_of(sunk), mesh_of(in_wall)};
  const auto bodies = take_movable(model, {sunk, in_wall});
  ASSERT_TRUE(bodies);
  ASSERT_EQ(bodies->size(), 2U);
  const Eigen::Vector3d raised = (*bodies)[0].T_map_body.translation() - sunk.T_map_body.translation();
  EXPECT_TRUE(raised.isApprox(Eigen::Vector3d(0, 0, 0.02), 1e-6)) << raised.transpose();
  const Eigen::Vector3d out = (*bodies)[1].T_map_body.translation() - in_wall.T_map_body.translation();
  EXPECT_LE(out.x(), -0.02);
  EXPECT_LT(out.norm(), 0.04) << "no farther than it must";
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_TRUE((*bodies)[i].mesh.vertices[0].isApprox(mesh_of((*bodies)[i]).vertices[0], 1e-5F)) << i;
  }
}

TEST(MovableObjects, StayWhereTheyAreUntilTouched) {
  ModelObject bin = site_object("bin 1", ObjectKind::bin, 2.2, 0.1, {0.25, 0.25, 0.3}, kTable.z() - 0.01);
  bin.on = "table 1";
  Simulation simulation =
      with_rover(taken({site_object("chair 1", ObjectKind::chair, 0, 2, kChair, -0.02),
                        site_object("table 1", ObjectKind::table, 2, 0, kTable, 0.03), bin}),
                 -2, 0);
  EXPECT_NEAR(place_of(simulation, "chair 1").z(), 0, 1e-9);
  EXPECT_NEAR(place_of(simulation, "bin 1").z(), kTable.z(), 1e-9);
  for (const char* name : {"chair 1", "table 1", "bin 1"})
    EXPECT_EQ(farthest_motion(simulation, name, 3), 0) << name;
  EXPECT_EQ(count(simulation.take_events(), EventKind::agent_spawned), 1U) << "the robot only";
}

TEST(MovableObjects, ARobotPushesAChair) {
  Simulation simulation =
      with_rover(taken({site_object("chair 1", ObjectKind::chair, 0, 0, kChair)}), -1.5, 0);
  drive(simulation, "r", {0.4, 0, 0}, 6);
  const Eigen::Vector3d at = place_of(simulation, "chair 1");
  EXPECT_GT(at.x(), 0.3);
  EXPECT_NEAR(at.y(), 0, 0.3);
  const auto contacts = only(simulation.take_events(), EventKind::contact_started);
  const auto touched = std::find_if(contacts.begin(), contacts.end(), [](const Event& event) {
    return event.subject == "r" && event.object == "chair 1";
  });
  ASSERT_NE(touched, contacts.end());
  EXPECT_GT(touched->impulse, 0);
}

TEST(MovableObjects, AHeavyTableStopsASmallRobot) {
  // Its leg stands in front of the robot.
  const ModelObject table = site_object("table 1", ObjectKind::table, 0, -kTable.y() / 2 + 0.03, kTable);
  ASSERT_GT(object_agent(table).mass, 40);
  Simulation simulation = with_rover(taken({table}), -2, 0);
  EXPECT_LT(farthest_motion(simulation, "table 1", 4, {0.4, 0, 0}), 0.06) << "the impact moves it a little";
  // Friction of many contacts is solved by iteration: under a steady push a body creeps by millimetres a
  // second.
  EXPECT_LT(farthest_motion(simulation, "table 1", 6, {0.4, 0, 0}), 0.03) << "instead of 2.4 m";
  EXPECT_NEAR(place_of(simulation, "r").x(), -0.8 - 0.205, 0.09);
}

TEST(MovableObjects, ARobotDrivesBetweenTheLegsOfATable) {
  Simulation simulation = with_rover(taken({site_object("table 1", ObjectKind::table, 0, 0, kTable)}), -2, 0);
  drive(simulation, "r", {0.4, 0, 0}, 9);
  EXPECT_GT(place_of(simulation, "r").x(), 1);
  EXPECT_LT(place_of(simulation, "table 1").norm(), 1e-3);
}

TEST(MovableObjects, OneThatStartsInAFloorOrAWallDoesNotJumpWhenTouched) {
  for (const bool in_wall : {false, true}) {
    // A step beside it keeps the robot from pushing it on.
    SemanticModel site = room(8);
    const ModelObject crate =
        site_object("box 1", ObjectKind::box, 0, in_wall ? 3.82 : 0, {0.5, 0.4, 0.8}, in_wall ? 0 : -0.02);
    Simulation simulation = with_rover(taken({crate}, site), -0.5, in_wall ? 3.7 : 0);
    const Eigen::Vector3d start = place_of(simulation, "box 1");
    EXPECT_LT((start - crate.T_map_body.translation() + Eigen::Vector3d(0, 0, 0.4)).norm(), 0.04);
    Eigen::Vector3d before = start;
    double fastest = 0, across = 0;
    for (int i = 0; i < 2400; ++i) {  // 10 s; it is touched in the first
      if (i < 240) simulation.teleop("r", {0.1, 0, 0});
      run(simulation, kStep);
      const Eigen::Vector3d now = place_of(simulation, "box 1");
      fastest = std::max(fastest, (now - before).norm() / kStep);
      across = std::max(across, (now - start).tail<2>().norm());
      before = now;
    }
    EXPECT_GE(count(simulation.take_events(), EventKind::contact_started), 1U) << in_wall;
    EXPECT_LT(fastest, 0.3) << "m/s, in_wall " << in_wall;
    EXPECT_LT(across, 0.03) << "m, beside the push, in_wall " << in_wall;
    EXPECT_LT((before - start).norm(), 0.2) << in_wall;
  }
}

TEST(MovableObjects, AChairsBackIsWhereItsMeshIsHigh) {
  ModelObject chair = site_object("chair 1", ObjectKind::chair, 1, 2, kChair);
  for (const double y : {-0.2, 0.2}) {
    chair.mesh.vertices = {{1.2F, 2, 0.4F}, {0.9F, static_cast<float>(2 + y), 0.8F}, {1, 2, 0}};
    chair.mesh.triangles = {{0, 1, 2}};
    const AgentForm form = object_form(chair);
    const Shape& back = form.pieces.back();
    EXPECT_GT(back.T_body_shape.translation().y() * y, 0);
    EXPECT_NEAR(back.T_body_shape.translation().z() + back.size.z() / 2, kChair.z(), 1e-9);
  }
}

TEST(MovableObjects, AreNotRemovedWithAllAgents) {
  Simulation simulation = with_rover(taken({site_object("chair 1", ObjectKind::chair, 0, 2, kChair)}), -2, 0);
  spawn(simulation, agent("crate", AgentKind::box, 0, -2));
  AgentRemove all;
  all.all = true;
  ASSERT_TRUE(simulation.command(all, std::nullopt).ok());
  EXPECT_FALSE(has_body(simulation, simulation.now(), "crate"));
  EXPECT_TRUE(has_body(simulation, simulation.now(), "chair 1"));
  const Status in_it = simulation.spawn(agent("crate", AgentKind::box, 0, 2), std::nullopt);
  ASSERT_FALSE(in_it.ok());
  EXPECT_NE(in_it.error().message.find("on the site's 'chair 1'"), std::string::npos)
      << in_it.error().message;
}

TEST(MovableObjects, NeedANameOfTheirOwn) {
  SimulationOptions options;
  options.objects = {site_object("wall 1", ObjectKind::box, 0, 0, kBox)};
  const auto made = Simulation::create(options, room(8), robot(), kStart);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.error().message.find("movable object 'wall 1'"), std::string::npos);
}

}  // namespace
}  // namespace parhelion::simulation
