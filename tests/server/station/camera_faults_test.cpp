#include "server/station/video/camera_faults.hpp"

#include <gtest/gtest.h>

namespace parhelion::test {
namespace {

Event fault(EventKind kind, const std::string& name, double amount) {
  Event event;
  event.kind = kind;
  event.object = name;
  event.value = amount;
  return event;
}

TEST(CameraFaults, EndingOneFaultKeepsAnotherOfItsKind) {
  station::CameraFaults faults;
  EXPECT_TRUE(faults.handle(fault(EventKind::fault_started, "camera_delay", 0.2)));
  EXPECT_TRUE(faults.handle(fault(EventKind::fault_started, "camera_delay", 0.4)));
  EXPECT_EQ(faults.delay(), 0.4);
  EXPECT_TRUE(faults.handle(fault(EventKind::fault_ended, "camera_delay", 0.4)));
  EXPECT_EQ(faults.delay(), 0.2);
  EXPECT_TRUE(faults.handle(fault(EventKind::fault_ended, "camera_delay", 0.2)));
  EXPECT_EQ(faults.delay(), 0);
}

TEST(CameraFaults, LossProbabilitiesCombineIndependently) {
  station::CameraFaults faults;
  faults.handle(fault(EventKind::fault_started, "camera_loss", 0.5));
  faults.handle(fault(EventKind::fault_started, "camera_loss", 0.5));
  EXPECT_EQ(faults.loss(), 0.75);
  EXPECT_EQ(faults.delay(), 0);
}

TEST(CameraFaults, IgnoresOtherFaultsAndEndsOfUnknownFaults) {
  station::CameraFaults faults;
  EXPECT_FALSE(faults.handle(fault(EventKind::fault_started, "laser_dropouts", 0.5)));
  EXPECT_FALSE(faults.handle(fault(EventKind::movement_started, "camera_loss", 0.5)));
  faults.handle(fault(EventKind::fault_ended, "camera_loss", 0.5));
  EXPECT_EQ(faults.loss(), 0);
}

}  // namespace
}  // namespace parhelion::test
