// A trainee's actions in the shipped level 1 scenario, by script: each one is on MR_EVENTS.
#include "tests/server/runtime/scripted_drive.hpp"

namespace parhelion::runtime {
namespace {

const std::string kWorkshop = std::string(PARHELION_SOURCE_DIR) + "/server/scenarios/workshop.yaml";

class WorkshopTest : public test::ScriptedDrive {
 protected:
  void TearDown() override {
    if (HasFailure()) std::fputs(event_log().c_str(), stderr);
  }
};

TEST_F(WorkshopTest, ATraineeLiftsAPartIntoTheContainer) {
  load(kWorkshop);
  wait(0.5);
  lift_part_into_container();
  EXPECT_TRUE(happened(EventKind::gripped, "part_1"));
  EXPECT_TRUE(happened(EventKind::lifted, "part_1"));
  EXPECT_TRUE(happened(EventKind::placed, "container_1"));
  EXPECT_FALSE(happened(EventKind::dropped));
}

TEST_F(WorkshopTest, ATraineeOpensADoorClimbsStairsAndTipsOver) {
  load(kWorkshop);
  wait(0.5);
  drive_to({5.2, 2.5}, 0.5, 10);
  drive_to({7, 2.5}, 0.5, 20);
  EXPECT_TRUE(happened(EventKind::movement_started));
  EXPECT_TRUE(happened(EventKind::door_space_entered, "door 1"));
  EXPECT_TRUE(happened(EventKind::contact_started, "door 1"));
  EXPECT_TRUE(happened(EventKind::door_opened, "door 1"));
  EXPECT_TRUE(happened(EventKind::zone_entered, "second room"));

  drive_to({7, 4.15}, 0.5, 20);
  drive_to({7.6, 4.15}, 0.4, 20);
  EXPECT_TRUE(climb_to({11, 4.15}, 40)) << motion().T_map_base.translation().transpose();
  for (const char* kStep : {"step 1", "step 2", "step 3", "step 4"})
    EXPECT_TRUE(happened(EventKind::step_climbed, kStep)) << kStep;
  EXPECT_NEAR(motion().T_map_base.translation().z(), 0.68, 0.05);
  EXPECT_FALSE(happened(EventKind::tipped_over, "trainee"));
  EXPECT_FALSE(happened(EventKind::fell));

  // Over the open side of the platform.
  drive_to({11, 1.5}, 0.6, 20, [this] { return happened(EventKind::tipped_over, "trainee"); });
  wait(2);
  EXPECT_TRUE(happened(EventKind::fell));
  EXPECT_TRUE(happened(EventKind::pitch_limit));
  EXPECT_TRUE(happened(EventKind::tipped_over, "trainee"));
  EXPECT_FALSE(happened(EventKind::localization_lost));
}

}  // namespace
}  // namespace parhelion::runtime
