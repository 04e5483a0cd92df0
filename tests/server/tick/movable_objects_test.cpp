// Movable objects of a site at level 1: the sensors show them where they were pushed to.
#include "tests/server/tick/levels_fixture.hpp"
#include "tests/site_objects.hpp"

namespace parhelion::tick {
namespace {

using test::level_1;
using test::LevelsTest;
using test::site_object;

class MovableObjectsTest : public LevelsTest {
 protected:
  /// A carton, whose surface is a mesh, 1 m in front of the robot.
  static Configuration with_carton() {
    Configuration configuration = level_1();
    ModelObject carton = site_object("box 1", ObjectKind::box, -1, 0, {0.4, 0.6, 0.5});
    carton.mesh = test::mesh_of(carton);
    configuration.objects = {carton};
    return configuration;
  }
  WorldMessage::Entry carton() {
    const WorldMessage world = decoded<WorldMessage>(channel::kMrWorld).back();
    for (const WorldMessage::Entry& body : world.bodies)
      if (body.entity == "box 1") return body;
    ADD_FAILURE() << "MR_WORLD has no such body";
    return {};
  }
  /// m, of the laser's beam straight ahead.
  double range_ahead() {
    const Scan scan = decoded<Scan>(channel::kScan).back();
    return scan.ranges[static_cast<std::size_t>(std::lround(-scan.angle_min / scan.angle_increment))];
  }
  /// m, from the laser to the carton's near side.
  double distance() {
    const auto T_map_laser = motion().T_map_base * configuration_.robot.laser->T_base_laser;
    return carton().T_map_body.translation().x() - 0.2 - T_map_laser.translation().x();
  }
};

TEST_F(MovableObjectsTest, AreInTheWorldAndInTheScanWhereTheyWerePushedTo) {
  start(with_carton());
  run(1);
  EXPECT_NEAR(carton().T_map_body.translation().x(), -1, 1e-6);
  EXPECT_EQ(carton().part, "box");
  EXPECT_NEAR(range_ahead(), 0.71, 0.05);
  run(5, Twist2{0.4, 0, 0});
  run(9, Twist2{-0.3, 0, 0});
  run(10);
  EXPECT_GT(carton().T_map_body.translation().x(), -0.6) << "it was pushed";
  EXPECT_GT(distance(), 0.5) << "and left behind";
  EXPECT_NEAR(range_ahead(), distance(), 0.05);
  const auto contacts = events(EventKind::contact_started);
  ASSERT_GE(contacts.size(), 1U);
  EXPECT_EQ(contacts[0].subject, "trainee");
  EXPECT_EQ(contacts[0].object, "box 1");
}

TEST_F(MovableObjectsTest, AreNamedInASession) {
  const Configuration configuration = with_carton();
  const std::vector<std::string> names = known_names(configuration);
  EXPECT_NE(std::find(names.begin(), names.end(), "box 1"), names.end());
  const auto again = configuration_from(session_header(configuration, {}), "log");
  ASSERT_TRUE(again) << again.error().message;
  ASSERT_EQ(again->objects.size(), 1U);
  EXPECT_EQ(again->objects[0].mesh.vertices, configuration.objects[0].mesh.vertices);
  EXPECT_EQ(again->objects[0].T_map_body.isometry().matrix(),
            configuration.objects[0].T_map_body.isometry().matrix());
}

TEST_F(MovableObjectsTest, AroundARealRobotThereAreNone) {
  const Configuration at_level_1 = with_carton();
  Scenario scenario;
  const auto configuration =
      configure(scenario, test::robot(), test::room(), {}, nullptr, at_level_1.objects);
  ASSERT_TRUE(configuration) << configuration.error().message;
  EXPECT_TRUE(configuration->objects.empty());
}

}  // namespace
}  // namespace parhelion::tick
