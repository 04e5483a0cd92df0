// A model's meshes, and removed entities: for bodies, the real robot and placement they behave like boxes.
#include "server/simulation/building/mesh_pieces.hpp"
#include "tests/box_mesh.hpp"
#include "worlds.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

/// A room of 6 m with a shelf, and a table with its top above the robots.
SemanticModel furnished() {
  SemanticModel model = room(6);
  model.entities.push_back(model_box("shelf", EntityLabel::unknown, {1.5, 0, 0.6}, {0.4, 1.5, 1.2}));
  model.entities.push_back(model_box("table top", EntityLabel::unknown, {-1.5, 0, 1.0}, {1.0, 1.5, 0.05}));
  return with_mesh(with_mesh(model, "shelf"), "table top");
}

TEST(ModelMeshes, StopAnAgentAndAreNamedInTheEvent) {
  Simulation simulation = make(furnished());
  spawn(simulation, moving("rover", AgentKind::robot, 0, 0, BehaviourKind::teleop));
  drive(simulation, "rover", {0.5, 0, 0}, 5);
  const double front = body(simulation, "rover", "chassis").T_map_body.translation().x();
  EXPECT_GT(front, 0.8) << "it drove up to the shelf";
  EXPECT_LT(front, 1.3) << "and not into it";
  const auto events = simulation.take_events();
  ASSERT_GE(count(events, EventKind::contact_started), 1U);
  for (const Event& event : events) {
    if (event.kind != EventKind::contact_started) continue;
    EXPECT_EQ(event.object, "shelf");
  }
}

TEST(ModelMeshes, LeaveRoomBelowThem) {
  Simulation simulation = make(furnished());
  AgentDefinition crate = agent("crate", AgentKind::box, -1.5, 0.1);
  crate.size = {0.3, 0.3, 0.3};
  spawn(simulation, crate);  // under the table: free
  run(simulation, 1);
  EXPECT_NEAR(body(simulation, "crate").T_map_body.translation().z(), 0, 0.01);
}

TEST(ModelMeshes, StopTheRealRobotLikeBoxes) {
  Simulation simulation = make(furnished());
  std::vector<LaserRequest> requests;
  for (int i = 0; i <= 600; ++i) {
    RealRobotState real = real_at(1.06 * i / 600, 0, 0, {0.4, 0, 0});
    real.sigma = 0.01;
    simulation.step(real, requests);
  }
  const auto events = only(simulation.take_events(), EventKind::contact_started);
  ASSERT_EQ(events.size(), 1U) << "many pieces, one contact";
  EXPECT_EQ(events[0].object, "shelf");
  EXPECT_NEAR(events[0].position.x(), 1.3, 0.01);
}

TEST(ModelMeshes, RefusePlacementInsideButNotBelowATable) {
  Simulation simulation = make(furnished());
  const Status in_shelf = simulation.spawn(agent("a", AgentKind::barrel, 1.35, 0.2), std::nullopt);
  ASSERT_FALSE(in_shelf.ok());
  EXPECT_NE(in_shelf.error().message.find("in 'shelf' of the building"), std::string::npos)
      << in_shelf.error().message;
  AgentDefinition low = agent("b", AgentKind::box, -1.5, 0);
  low.size = {0.4, 0.4, 0.6};
  EXPECT_TRUE(simulation.spawn(low, std::nullopt).ok());
  AgentDefinition high = agent("c", AgentKind::box, -1.5, 0.5);
  high.size = {0.4, 0.4, 1.4};
  EXPECT_FALSE(simulation.spawn(high, std::nullopt).ok());
}

TEST(ModelMeshes, PartsCoverTheMeshAndAddLessThanACell) {
  ModelEntity box = model_box("b", EntityLabel::unknown, {0.13, -2.41, 0.77}, {1.3, 0.7, 0.9}, 0.4);
  const ModelMesh mesh = box_mesh(box);
  const auto pieces = mesh_pieces(mesh);
  ASSERT_FALSE(pieces.empty());
  for (const auto& triangle : mesh.triangles) {
    for (int i = 0; i <= 20; ++i) {
      for (int j = 0; i + j <= 20; ++j) {
        const Eigen::Vector3d a = mesh.vertices[triangle[0]].cast<double>(),
                              b = mesh.vertices[triangle[1]].cast<double>(),
                              c = mesh.vertices[triangle[2]].cast<double>();
        const Eigen::Vector3d p = a + (b - a) * i / 20.0 + (c - a) * j / 20.0;
        EXPECT_TRUE(std::any_of(pieces.begin(), pieces.end(), [&](const MeshPiece& piece) {
          return piece.bottom <= p.z() + 1e-9 && piece.top >= p.z() - 1e-9 &&
                 signed_distance(make_disc(p.head<2>(), 0), piece.footprint) < 2e-6;
        })) << p.transpose();
      }
    }
  }
  for (const MeshPiece& piece : pieces) {
    EXPECT_LE(piece.top - piece.bottom, kMeshCell + 1e-9);
    for (const Eigen::Vector2d& v : piece.footprint.vertices) {
      const Eigen::Vector3d local = box.T_map_body.inverse() * Eigen::Vector3d(v.x(), v.y(), piece.bottom);
      EXPECT_LE(std::abs(local.x()), box.size.x() / 2 + 2e-6);
      EXPECT_LE(std::abs(local.y()), box.size.y() / 2 + 2e-6);
    }
  }
}

TEST(ModelMeshes, AHugeTriangleIsCutIntoFewPieces) {
  const ModelMesh mesh{"plain", {{-5e5F, -5e5F, 0}, {5e5F, -5e5F, 1}, {0, 5e5F, 2}}, {{0, 1, 2}}};
  EXPECT_LT(mesh_pieces(mesh, 10'000).size(), 10'000U);
}

TEST(NonSolidEntities, FreeSpaceAndDeletedEntitiesStopNoRobot) {
  SemanticModel model = room(6);
  model.entities.push_back(model_box("door opening", EntityLabel::free_space, {1, 0, 1}, {0.8, 0.9, 2}));
  model.entities.push_back(model_box("ghost", EntityLabel::wall, {2, 0, 1}, {0.2, 4, 2}));
  model.entities.back().deleted = true;
  Simulation simulation = make(model);
  EXPECT_TRUE(simulation.spawn(agent("barrel", AgentKind::barrel, 2, 1), std::nullopt).ok());
  spawn(simulation, moving("rover", AgentKind::robot, 0, 0, BehaviourKind::teleop));
  drive(simulation, "rover", {0.5, 0, 0}, 5);
  EXPECT_GT(body(simulation, "rover", "chassis").T_map_body.translation().x(), 1.9);
  EXPECT_EQ(count(simulation.take_events(), EventKind::contact_started), 0U);
}

}  // namespace
}  // namespace parhelion::simulation
