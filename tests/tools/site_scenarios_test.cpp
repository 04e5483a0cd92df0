// From 3D scans of real sites to robots that drive in them, with the documented commands of the scenarios.
#include "tests/recordings.hpp"
#include "tests/tools/site_drive.hpp"

namespace parhelion::tools {
namespace {

using SiteScenarioTest = test::SiteDrive;

TEST_F(SiteScenarioTest, ATraineeCompletesTheTasksOfARealEntrance) {
  const auto cloud = test::recording("3d-ori-stairs/06.pcd");
  PARHELION_NEEDS_RECORDING(cloud);
  make_site("entrance", cloud);
  wait(0.5);
  lift_part_into_container();
  EXPECT_TRUE(happened(EventKind::lifted, "part_1"));
  EXPECT_TRUE(happened(EventKind::placed, "container_1"));
  reach(0.4, 0.7, 0, 5);  // the arm in front, within the width of the gate
  EXPECT_TRUE(drive_to({0, 0.75}, 0.5, 30)) << motion().T_map_base.translation().transpose();
  EXPECT_TRUE(happened(EventKind::door_opened, "gate 1"));
  EXPECT_TRUE(climb_to({4.5, 0.85}, 60)) << motion().T_map_base.translation().transpose();
  for (const char* kStep : {"stairs 1 step 1", "stairs 1 step 2", "stairs 1 step 3", "stairs 1 step 4"})
    EXPECT_TRUE(happened(EventKind::step_climbed, kStep)) << kStep;
  EXPECT_TRUE(happened(EventKind::zone_entered, "landing"));
  EXPECT_NEAR(motion().T_map_base.translation().z(), 1.27, 0.06);
  EXPECT_FALSE(happened(EventKind::tipped_over, "trainee"));
}

TEST_F(SiteScenarioTest, ARobotOpensAGalleryDoorAndDrivesThrough) {
  const auto scans = test::recording("3d-3dtk-corridor");
  PARHELION_NEEDS_RECORDING(scans);
  const auto registered = test::run({"map", "register", scans / "scan000.3d", scans / "scan001.3d",
                                     scans / "scan002.3d", "-o", folder_ / "gallery.ply"},
                                    folder_ / "register.txt");
  ASSERT_EQ(registered.exit, 0) << registered.output;
  make_site("gallery", folder_ / "gallery.ply", {"--floor-to-zero", "--slice", folder_ / "gallery_map"});
  wait(0.5);
  EXPECT_TRUE(drive_to({1.65, -2.4}, 0.4, 30)) << motion().T_map_base.translation().transpose();
  EXPECT_TRUE(happened(EventKind::door_space_entered, "door 2"));
  EXPECT_TRUE(happened(EventKind::door_opened, "door 2"));
  EXPECT_TRUE(happened(EventKind::zone_entered, "room"));
  EXPECT_FALSE(happened(EventKind::fell));
}

}  // namespace
}  // namespace parhelion::tools
