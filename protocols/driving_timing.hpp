// How often each link of the driving chain sends, and after how long a silence the next one stops the robot.
//
//   browser page --twist--> base station --TELEOP--> server (tick) --MR_CMD--> robot
//                           or a console ---------^
//
// While a dead-man is held, twist and TELEOP come each 50 ms (command_period). When nothing more comes:
//
//   0      0.3     0.5              1.0              1.5              2.0 s after the last message
//   |-------|-------|----------------|----------------|----------------|
//   twist   |                                                          page_lost: its console is lost
//           page_silence: the station releases the dead-man and stops the robot (zeros for stop_duration)
//   TELEOP          teleop_silence: MR_CMD is a stop, each stop_period; the dead-man counts as released
//   OPERATOR                         console_silence: the console is lost, its robot stops
//                                                     operator_shown: pages no longer list the operator
//
// A robot's own watchdog on MR_CMD is the robot's: 0.3 s or less. The page has command_period in
// server/station/web/src/drive/sender.ts.
#pragma once

#include "protocols/time.hpp"

namespace parhelion::driving_timing {

/// TELEOP of a page or a keyboard while a dead-man is held. A joystick's mapping has a rate of its own.
inline constexpr Duration command_period = milliseconds(50);
/// After a release a console sends zeros for so long: a message may be lost on its way.
inline constexpr Duration stop_duration = milliseconds(300);

// The base station, of a page that drives.

/// Nothing from a page that holds a dead-man: it is released.
inline constexpr Duration page_silence = milliseconds(300);
/// A command that is older than the fastest by more is dropped, and the robot stops.
inline constexpr Duration command_lateness = milliseconds(250);
/// So is one that is not certainly younger, by both clocks.
inline constexpr Duration command_max_age = milliseconds(1000);
/// Nothing at all from the page: its console is lost.
inline constexpr Duration page_lost = seconds(2.0);
/// How often an emergency stop is sent again until the server answers.
inline constexpr Duration emergency_stop_period = milliseconds(100);

// The server.

/// No TELEOP, or no JOINT_CMD: a stop. A scenario may have another one (`contact: silence`). Also how long a
/// simulated robot obeys one command.
inline constexpr Duration teleop_silence = milliseconds(500);
/// How often the stop is sent again: a command may be lost on its way.
inline constexpr Duration stop_period = milliseconds(100);
/// Motion asked for within this time before the silence: the dead-man was released while driving.
inline constexpr Duration release_while_driving = seconds(1.0);

// OPERATOR: which console drives whom.

/// A console sends its status at least so often.
inline constexpr Duration console_heartbeat = milliseconds(400);
/// Without a status for so long the console is lost, and its robot stops.
inline constexpr Duration console_silence = seconds(1.0);
/// Without a status for so long pages no longer list the operator.
inline constexpr Duration operator_shown = milliseconds(1500);

// A single lost message stops nobody; each link stops before the next one has to.
static_assert(page_silence.ns >= 3 * command_period.ns);
static_assert(command_lateness < page_silence);
static_assert(page_silence < teleop_silence);
static_assert(teleop_silence < console_silence);
static_assert(console_silence.ns >= 2 * console_heartbeat.ns);
static_assert(console_silence < operator_shown);
static_assert(console_silence < page_lost);

}  // namespace parhelion::driving_timing
