// Periods of the messages in the driving chain, and the timeouts after which the next link stops the robot.
//
//   browser page --twist--> base station --TELEOP--> server (tick) --MR_CMD--> robot
//                           or a console ---------^
//
// While a dead-man is held, twist and TELEOP are sent every 50 ms (command_period). After the last message:
//
//   0      0.3     0.5              1.0              1.5              2.0 s after the last message
//   |-------|-------|----------------|----------------|----------------|
//   twist   |                                                          page_lost: its console is lost
//           page_silence: the station releases the dead-man and stops the robot (zeros for stop_duration)
//   TELEOP          teleop_silence: MR_CMD is a stop, each stop_period; the dead-man counts as released
//   OPERATOR                         console_silence: the console is lost, its robot stops
//                                                     operator_shown: pages no longer list the operator
//
// A robot's own watchdog on MR_CMD is the robot's responsibility: 0.3 s or less. The page's command_period is
// in server/station/web/src/drive/sender.ts.
#pragma once

#include "protocols/time.hpp"

namespace parhelion::driving_timing {

/// TELEOP of a page or a keyboard while a dead-man is held. A joystick's mapping has its own rate.
inline constexpr Duration command_period = milliseconds(50);
/// After a release a console sends zeros for this long, as a message may be lost.
inline constexpr Duration stop_duration = milliseconds(300);

// The base station, for a page that drives.

/// Timeout of a page that holds a dead-man: the dead-man is released.
inline constexpr Duration page_silence = milliseconds(300);
/// A command delayed by more than this relative to the fastest one is dropped, and the robot stops.
inline constexpr Duration command_lateness = milliseconds(250);
/// So is a command that may be older than this by either clock.
inline constexpr Duration command_max_age = milliseconds(1000);
/// Timeout of all messages from the page: its console is lost.
inline constexpr Duration page_lost = seconds(2.0);
/// Period at which an emergency stop is repeated until the server replies.
inline constexpr Duration emergency_stop_period = milliseconds(100);

// The server.

/// Timeout of TELEOP and JOINT_CMD: a stop. A scenario may set another one (`contact: silence`). Also how
/// long a simulated robot executes one command.
inline constexpr Duration teleop_silence = milliseconds(500);
/// Period at which the stop is repeated, as a command may be lost.
inline constexpr Duration stop_period = milliseconds(100);
/// Motion commanded within this time before the timeout: the dead-man was released while driving.
inline constexpr Duration release_while_driving = seconds(1.0);

// OPERATOR: which console drives which robot.

/// Maximum period of a console's status.
inline constexpr Duration console_heartbeat = milliseconds(400);
/// Timeout of the status: the console is lost, and its robot stops.
inline constexpr Duration console_silence = seconds(1.0);
/// Timeout of the status after which pages no longer list the operator.
inline constexpr Duration operator_shown = milliseconds(1500);

// A single lost message does not stop a robot; each link stops before the next one has to.
static_assert(page_silence.ns >= 3 * command_period.ns);
static_assert(command_lateness < page_silence);
static_assert(page_silence < teleop_silence);
static_assert(teleop_silence < console_silence);
static_assert(console_silence.ns >= 2 * console_heartbeat.ns);
static_assert(console_silence < operator_shown);
static_assert(console_silence < page_lost);

}  // namespace parhelion::driving_timing
