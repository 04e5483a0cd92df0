// The movable objects of a model file in sessions: bodies at levels 1 and 2, parts of the site at level 3,
// the same bytes in each replay.
#include "server/runtime/session_files.hpp"
#include "tests/server/runtime/replay_fixture.hpp"
#include "tests/server/tick/levels_fixture.hpp"
#include "tests/site_objects.hpp"

namespace parhelion::runtime {
namespace {

using test::site_object;

class MovableObjectsSession : public test::ReplayFixture {
 protected:
  /// The room with a chair and a carton before a rover that is driven forwards for 4 s.
  void write_files(int level) {
    Scenario scenario;
    scenario.name = "pushing";
    scenario.level = level;
    scenario.model = "model.yaml";
    scenario.agents = {test::agent("robot_1", AgentKind::robot, 3, 2, BehaviourKind::wander)};
    scenario.agents[0].laser = "lms-200";
    if (level == 3) scenario.robot = "robot.yaml";
    if (level < 3) {
      scenario.trainee.emplace();
      scenario.trainee->model = "rover";
      scenario.trainee->T_map_base = Transform<Map, Base>::planar(-2, 0, 0);
    }
    std::vector<Message> log;
    for (double t = 0; t < 4; t += 0.05) log.push_back(test::teleop_at(t, 0.4));
    write(scenario, test::robot(), log);
    ModelRemarks remarks;
    remarks.objects = {site_object("box 1", ObjectKind::box, -1, 0, {0.4, 0.6, 0.5}, -0.02),
                       site_object("chair 1", ObjectKind::chair, -0.4, 0.1, {0.46, 0.44, 0.9}, -0.01)};
    SemanticModel model = test::room();
    for (const ModelObject& object : remarks.objects) model.meshes.push_back(test::mesh_of(object));
    std::ofstream(folder_ / "model.yaml") << to_yaml(model) << to_yaml(remarks);
  }
  /// x, m, of the entity's body in the last world of a session; none: no such body.
  std::optional<double> x_of(const std::string& entity, const std::string& session) {
    const auto payloads = test::payloads_by_channel(folder_ / session)[channel::kMrWorld];
    WorldMessage world;
    if (payloads.empty() || !decode(channel::kMrWorld, payloads.back(), world)) return std::nullopt;
    for (const WorldMessage::Entry& body : world.bodies)
      if (body.entity == entity) return body.T_map_body.translation().x();
    return std::nullopt;
  }
};

TEST_F(MovableObjectsSession, ReplayToTheSameBytesWithAnyThreadCountAndWithoutFiles) {
  write_files(1);
  const Report first = run(options("a.lcm"));
  EXPECT_GT(x_of("box 1", "a.lcm").value_or(-9), -0.6);
  EXPECT_GT(x_of("chair 1", "a.lcm").value_or(-9), -0.2) << "pushed by the carton";
  expect_same_bytes_for_any_thread_count(first);
  expect_replay_without_files(first);
}

TEST_F(MovableObjectsSession, AreBodiesAtLevel2AndPartsOfTheSiteAtLevel3) {
  write_files(2);
  const auto at_2 = load_session_files(folder_ / "scenario.yaml", "");
  ASSERT_TRUE(at_2) << at_2.error().message;
  EXPECT_EQ(at_2->objects.size(), 2U);
  EXPECT_TRUE(at_2->model.meshes.empty());
  write_files(3);
  const auto at_3 = load_session_files(folder_ / "scenario.yaml", "");
  ASSERT_TRUE(at_3) << at_3.error().message;
  EXPECT_TRUE(at_3->objects.empty());
  EXPECT_EQ(at_3->model.meshes.size(), 2U);
  test::write_log(folder_ / "drive.lcm", test::drive(5));
  run(options("real.lcm"));
  EXPECT_FALSE(x_of("box 1", "real.lcm")) << "no body of its own";
  EXPECT_TRUE(x_of("robot_1", "real.lcm"));
}

}  // namespace
}  // namespace parhelion::runtime
