#include "server/station/video/camera_lessons.hpp"

#include <gtest/gtest.h>

namespace parhelion::test {
namespace {

Event lesson(EventKind kind, const std::string& name, double amount) {
  Event event;
  event.kind = kind;
  event.object = name;
  event.value = amount;
  return event;
}

TEST(CameraLessons, OneThatEndsLeavesAnotherOfItsKindAsItIs) {
  station::CameraLessons lessons;
  EXPECT_TRUE(lessons.hear(lesson(EventKind::lesson_started, "camera_delay", 0.2)));
  EXPECT_TRUE(lessons.hear(lesson(EventKind::lesson_started, "camera_delay", 0.4)));
  EXPECT_EQ(lessons.delay(), 0.4);
  EXPECT_TRUE(lessons.hear(lesson(EventKind::lesson_ended, "camera_delay", 0.4)));
  EXPECT_EQ(lessons.delay(), 0.2);
  EXPECT_TRUE(lessons.hear(lesson(EventKind::lesson_ended, "camera_delay", 0.2)));
  EXPECT_EQ(lessons.delay(), 0);
}

TEST(CameraLessons, LossesAddUpToWhatIsLeftOutByAny) {
  station::CameraLessons lessons;
  lessons.hear(lesson(EventKind::lesson_started, "camera_loss", 0.5));
  lessons.hear(lesson(EventKind::lesson_started, "camera_loss", 0.5));
  EXPECT_EQ(lessons.loss(), 0.75);
  EXPECT_EQ(lessons.delay(), 0);
}

TEST(CameraLessons, OthersAndEndsOfWhatWasNotHeardOfAreNothing) {
  station::CameraLessons lessons;
  EXPECT_FALSE(lessons.hear(lesson(EventKind::lesson_started, "laser_dropouts", 0.5)));
  EXPECT_FALSE(lessons.hear(lesson(EventKind::movement_started, "camera_loss", 0.5)));
  lessons.hear(lesson(EventKind::lesson_ended, "camera_loss", 0.5));
  EXPECT_EQ(lessons.loss(), 0);
}

}  // namespace
}  // namespace parhelion::test
