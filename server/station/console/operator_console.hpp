// What any console says on the bus: one operator drives exactly one robot at a time, real or virtual.
#pragma once

#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/codec.hpp"

namespace parhelion::station {

/// A robot that can be driven, and where its commands go.
struct DrivenRobot {
  std::string name;
  std::string teleop;  ///< channel
  std::string joints;  ///< channel; empty: its joints cannot be moved from here
};

/// The robots in a world message: the trainee's (TELEOP, JOINT_CMD) first, then the agents that are robots
/// (MR_AGENT_<name>_TELEOP), each once.
std::vector<DrivenRobot> robots_in(const WorldMessage& world);

/// Not thread-safe. Instants are the console's own clock.
class OperatorConsole {
 public:
  /// `name` of the operator: letters, digits, '_' and '-'; `console`: which one, for people.
  OperatorConsole(Bus& bus, std::string name, std::string console);

  /// Those that exist now; one that is driven and is gone is let go.
  void set_robots(std::vector<DrivenRobot> robots);
  const std::vector<DrivenRobot>& robots() const { return robots_; }
  /// nullptr: none yet.
  const DrivenRobot* driven() const;

  /// Stops the robot that is driven, then drives `robot`. Error: there is none of this name; the message says
  /// which there are.
  Status drive(const std::string& robot, SensorTime now);
  /// The next one in the list after the one that is driven.
  Status drive_next(SensorTime now);

  /// Sends the command to the one robot; without one, nothing. Says who drives, at least twice a second.
  Status command(const Twist2& twist, SensorTime now);
  /// Speeds of joints, rad/s or m/s; refused where the robot's joints cannot be moved from here.
  Status joints(const std::vector<std::string>& names, const std::vector<double>& velocities, SensorTime now);
  /// The heartbeat alone, for a console that stands still.
  Status beat(SensorTime now);

  /// Stops, and says that the console is lost; `why` is for people. Another drive() comes back.
  Status lose(const std::string& why, SensorTime now);
  /// Stops, and says that the operator has ended.
  Status end(SensorTime now);

 private:
  Status stop(SensorTime now);
  Status say(OperatorWord::State state, const std::string& text, SensorTime now);

  Bus& bus_;
  std::string name_, console_;
  std::vector<DrivenRobot> robots_;
  std::string driven_;
  SensorTime said_;
  std::vector<std::uint8_t> payload_;
};

}  // namespace parhelion::station
