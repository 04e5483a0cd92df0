// Periods of the messages in the driving chain, and the timeouts after which the next link stops the robot.
//
//   browser page --twist--> base station --TELEOP--> server (tick) --MR_CMD--> robot
//                           or a console ---------^
//
// While a dead-man is held, twist and TELEOP are sent every 50 ms (kCommandPeriod). After the last message:
//
//   0      0.3     0.5              1.0              1.5              2.0 s after the last message
//   |-------|-------|----------------|----------------|----------------|
//   twist   |                                                          kClientLost: its console is lost
//           kClientSilence: the station releases the dead-man and stops the robot (zeros for kStopDuration)
//   TELEOP          kTeleopSilence: MR_CMD is a stop, each kStopPeriod; the dead-man counts as released
//   OPERATOR                         kConsoleSilence: the console is lost, its robot stops
//                                                     kOperatorShown: pages no longer list the operator
//
// At the robot's end of a signed bus `relay` sends a stop kRelaySilence after the last MR_CMD that moves it.
// A robot's own watchdog on MR_CMD is the robot's responsibility: 0.3 s or less. The page's kCommandPeriod is
// in server/station/web/src/drive/sender.ts.
#pragma once

#include "protocols/time.hpp"

namespace parhelion::driving_timing {

/// TELEOP of a page or a keyboard while a dead-man is held. A joystick's mapping has its own rate.
inline constexpr Duration kCommandPeriod = milliseconds(50);
/// After a release a console sends zeros for this long, as a message may be lost.
inline constexpr Duration kStopDuration = milliseconds(300);

// The base station, for a page that drives.

/// Timeout of a page that holds a dead-man: the dead-man is released.
inline constexpr Duration kClientSilence = milliseconds(300);
/// A command delayed by more than this relative to the fastest one is dropped, and the robot stops.
inline constexpr Duration kCommandLateness = milliseconds(250);
/// So is a command that may be older than this by either clock.
inline constexpr Duration kMaxClockAge = milliseconds(1000);
/// Timeout of all messages from the page: its console is lost.
inline constexpr Duration kClientLost = seconds(2.0);
/// Period at which an emergency stop is repeated until the server replies.
inline constexpr Duration kEmergencyStopPeriod = milliseconds(100);

// The server.

/// Timeout of TELEOP and JOINT_CMD: a stop. A scenario may set another one (`contact: silence`). Also how
/// long a simulated robot executes one command.
inline constexpr Duration kTeleopSilence = milliseconds(500);
/// Age of TELEOP or JOINT_CMD, from its receipt by the kernel until the server takes it, above which it is
/// refused: after a pause of the process the trainee no longer means it.
inline constexpr Duration kMaxQueueAge = milliseconds(250);
/// Age of an instructor's command above which it is refused. Shorter than pages and `inject` wait for a
/// reply: what they report as failed must not happen later. An emergency stop is never too old.
inline constexpr Duration kMaxCommandAge = seconds(2.0);
/// Period at which the stop is repeated, as a command may be lost.
inline constexpr Duration kStopPeriod = milliseconds(100);
/// Motion commanded within this time before the timeout: the dead-man was released while driving.
inline constexpr Duration kReleaseWhileDriving = seconds(1.0);

// The robot's end of a signed bus.

/// Timeout of commands that move the robot or its joints, after which `relay` sends a stop.
inline constexpr Duration kRelaySilence = milliseconds(300);

// OPERATOR: which console drives which robot.

/// Maximum period of a console's status.
inline constexpr Duration kConsoleHeartbeat = milliseconds(400);
/// Timeout of the status: the console is lost, and its robot stops.
inline constexpr Duration kConsoleSilence = seconds(1.0);
/// Timeout of the status after which pages no longer list the operator.
inline constexpr Duration kOperatorShown = milliseconds(1500);

// A single lost message does not stop a robot; each link stops before the next one has to.
static_assert(kClientSilence.ns >= 3 * kCommandPeriod.ns);
static_assert(kCommandLateness < kClientSilence);
static_assert(kClientSilence < kTeleopSilence);
static_assert(kTeleopSilence < kConsoleSilence);
static_assert(kConsoleSilence.ns >= 2 * kConsoleHeartbeat.ns);
static_assert(kConsoleSilence < kOperatorShown);
static_assert(kConsoleSilence < kClientLost);

}  // namespace parhelion::driving_timing
