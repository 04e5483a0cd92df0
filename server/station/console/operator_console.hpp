// The messages of a console on the bus: one operator drives exactly one robot at a time, real or virtual.
#pragma once

#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/codec.hpp"

namespace parhelion::station {

/// A robot that can be driven, and the channels of its commands.
struct DrivenRobot {
  std::string name;
  std::string teleop;  ///< channel
  std::string joints;  ///< channel; empty: its joints cannot be moved from this console
};

/// The robots in a world message: the trainees' (TELEOP, JOINT_CMD, of several with their names) first, then
/// the agents that are robots (MR_AGENT_<name>_TELEOP and _JOINT_CMD), each once.
std::vector<DrivenRobot> robots_in(const WorldMessage& world);

/// Why an operator's name is invalid (1 to 40 letters, digits, '_', '-'), or empty.
std::string operator_name_fault(const std::string& name);

/// Not thread-safe. Instants are of the console's own clock.
class OperatorConsole {
 public:
  /// `name` of the operator, see operator_name_fault(); `console`: kind of console, for people.
  OperatorConsole(Bus& bus, std::string name, std::string console);

  /// Robots that exist now. A driven robot that is no longer among them is released.
  void set_robots(std::vector<DrivenRobot> robots);
  const std::vector<DrivenRobot>& robots() const { return robots_; }
  /// nullptr: none yet.
  const DrivenRobot* driven() const;

  /// Stops the driven robot, then drives `robot`. Error: no robot of this name; the message lists the names.
  Status drive(const std::string& robot, SensorTime now);
  /// Drives the robot after the driven one in the list.
  Status drive_next(SensorTime now);

  /// Sends the command to the driven robot, if any. Reports the operator at least twice a second.
  Status command(const Twist2& twist, SensorTime now);
  /// Speeds of joints, rad/s or m/s. Error: the robot's joints cannot be moved from this console.
  Status joints(const std::vector<std::string>& names, const std::vector<double>& velocities, SensorTime now);
  /// Sends the heartbeat alone, for a console without commands.
  Status beat(SensorTime now);

  /// Stops the robot and reports that the console is lost; `why` is for people. drive() resumes.
  Status lose(const std::string& why, SensorTime now);
  /// Stops the robot and reports that the operator has ended.
  Status end(SensorTime now);

 private:
  Status stop(SensorTime now);
  Status publish_status(OperatorStatus::State state, const std::string& text, SensorTime now);

  Bus& bus_;
  std::string name_, console_;
  std::vector<DrivenRobot> robots_;
  std::string driven_;
  SensorTime last_published_;
  std::vector<std::uint8_t> payload_;
};

}  // namespace parhelion::station
