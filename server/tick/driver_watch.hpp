// Whether two consoles drive one robot at once.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "protocols/pose2.hpp"
#include "protocols/robot.hpp"
#include "protocols/time.hpp"

namespace parhelion::tick {

/// TELEOP does not name its sender. Where two consoles send it, the commands of one alternate with those of
/// the other: the change from one command to the next turns round far more often than a hand can. A program
/// may do that alone, so both have to have claimed the robot (OPERATOR). Two consoles that command the same
/// are not noticed until one of them lets go.
class DriverWatch {
 public:
  /// Each accepted TELEOP.
  void add(ArrivalTime arrival, const Twist2& twist, const RobotDescription& robot);
  /// A console claims the robot while another one has it: they say so twice a second.
  void contest(SimulationTime now) { contested_ = now; }
  /// True from the conflict's start until commands have not alternated for half a second.
  bool conflict(SimulationTime now) const;

 private:
  static constexpr std::size_t kTurns = 7;

  std::optional<Twist2> last_, before_last_, last_change_;
  std::array<ArrivalTime, kTurns> turns_{};  ///< when the change last turned round, cyclic
  std::size_t next_ = 0;
  std::optional<ArrivalTime> noticed_;
  std::optional<SimulationTime> contested_;
};

}  // namespace parhelion::tick
