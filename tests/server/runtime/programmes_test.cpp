// The shipped programmes of levels 1 and 2, driven by scripts to a known grade: well, and badly.
#include "tests/server/runtime/graded_drive.hpp"

namespace parhelion::runtime {
namespace {

class Programmes : public test::GradedDrive {};

TEST_F(Programmes, TheFirstDriveIsPassedFromMarkToMark) {
  begin("programmes/first_drive.yaml");
  drive_by({{6, 2}, {6, 6}, {2, 6}}, 0.7);
  stand(5);
  EXPECT_EQ(grade().score, 100);
  EXPECT_EQ(grade().grade, "excellent");
  EXPECT_TRUE(grade().passed);
}

TEST_F(Programmes, TheFirstDriveFailsBesideTheMarksAndAtTheWall) {
  begin("programmes/first_drive.yaml");
  drive_by({{6, 2}, {6, 6}}, 0.7);
  drive_to({-1, 8}, 0.7, 12);
  EXPECT_EQ(grade().awarded, 50);
  EXPECT_GE(grade().deducted, 10);
  EXPECT_EQ(grade().grade, "");
  EXPECT_FALSE(grade().passed);
}

TEST_F(Programmes, TheDoorwayIsPassedInBothDirectionsWithoutContact) {
  begin("programmes/doorway.yaml");
  drive_by({{5.2, 2.5}, {7.4, 2.5}, {5.2, 2.5}, {3, 2.5}}, 0.6);
  stand(4);
  EXPECT_EQ(grade().score, 100);
  EXPECT_TRUE(grade().passed);
}

TEST_F(Programmes, TheDoorwayTaskFailsOnFrameContact) {
  begin("programmes/doorway.yaml");
  drive_to({5.2, 2.85}, 0.6, 12);
  drive_to({7.4, 2.9}, 0.6, 6);
  EXPECT_EQ(grade().tasks[0].outcome, training::TaskOutcome::failed);
  EXPECT_EQ(grade().tasks[0].cause->kind, EventKind::contact_started);
  EXPECT_EQ(grade().score, 0);
  EXPECT_FALSE(grade().passed);
}

TEST_F(Programmes, TheSlalomGoesBetweenTheBarrelsIntoTheBay) {
  begin("programmes/slalom.yaml");
  drive_by({{2.8, 6.2}, {3.8, 6.2}, {5.2, 5}, {6.4, 3.7}, {7.6, 5}, {9, 6.2}, {10.4, 5}, {12, 5}, {14, 8}},
           0.8);
  stand(5);
  EXPECT_EQ(grade().score, 100);
  EXPECT_TRUE(grade().passed);
}

TEST_F(Programmes, AnObjectIsLiftedAndPutIntoTheContainer) {
  begin("programmes/lift_and_place.yaml");
  lift_part_into_container();
  EXPECT_EQ(grade().awarded, 100);
  EXPECT_EQ(grade().grade, "excellent");
  EXPECT_TRUE(grade().passed);
}

TEST_F(Programmes, AHiddenObjectIsFoundWithTheCameraAndReported) {
  begin("programmes/find_and_report.yaml");
  drive_by({{12.3, 5}, {12.6, 6.2}}, 0.7);
  report("barrel_1", {13, 8});
  look_at({13, 8.5});
  wait(2.5);
  report("barrel_1", {13, 8});
  drive_by({{12.6, 4}}, 0.7);
  look_at({13, 1.5});
  wait(2.5);
  report("person_1", {13, 3});
  EXPECT_EQ(grade().tasks[0].outcome, training::TaskOutcome::open) << "1.5 m off";
  report("person_1", {13, 2});
  drive_by({{12.3, 5}, {4.3, 5}}, 0.7);
  EXPECT_EQ(grade().score, 100);
  EXPECT_TRUE(grade().passed);
}

TEST_F(Programmes, TheStairsAreClimbedWithinPitchAndRoll) {
  begin("programmes/stairs.yaml");
  drive_to({7.6, 4.15}, 0.4, 10);
  EXPECT_TRUE(climb_to({11, 4.15}, 40));
  stand(5);
  EXPECT_EQ(grade().awarded, 100);
  EXPECT_TRUE(grade().passed);
}

TEST_F(Programmes, AGuideIsFollowedThroughABusyHall) {
  begin("programmes/busy_hall.yaml");
  const auto guide = [this]() -> Eigen::Vector2d {
    return state_->simulation.pose_of("guide")->translation().head<2>();
  };
  const auto follow = [&] {
    const double away = (guide() - motion().T_map_base.translation().head<2>()).norm();
    return towards(guide(), away > 1.6 ? 0.6 : 0);
  };
  drive(
      follow, [this] { return grade().tasks[1].outcome == training::TaskOutcome::done; }, 40);
  stand(6);
  EXPECT_EQ(grade().score, 100);
  EXPECT_TRUE(grade().passed);
}

TEST_F(Programmes, TheSourceIsMeasuredWithoutTriggeringADevice) {
  begin("programmes/hazards.yaml");
  drive_by({{3, 3.8}, {7, 3.8}, {11, 4.6}, {12.2, 4.3}}, 0.8);
  wait(4);
  drive_by({{11, 4.6}, {7, 3.8}, {3, 3.8}, {1.8, 4.8}}, 0.8);
  EXPECT_EQ(grade().score, 100);
  EXPECT_TRUE(grade().passed);
}

TEST_F(Programmes, DrivingIntoADeviceFails) {
  begin("programmes/hazards.yaml");
  drive_to({5.2, 5.4}, 0.8, 8);
  EXPECT_EQ(grade().tasks[0].outcome, training::TaskOutcome::failed);
  EXPECT_GE(grade().deducted, 40);
  EXPECT_FALSE(grade().passed);
}

}  // namespace
}  // namespace parhelion::runtime
