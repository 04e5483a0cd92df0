// Publishes a recording on the network such that no robot obeys its old commands.
#pragma once

#include <set>
#include <string>

#include "protocols/bus/bus.hpp"
#include "protocols/scenario.hpp"

namespace parhelion::tools {

/// With a prefix ("PLAY_") all messages are published, under names without receivers. Without one, commands
/// (to robots, to agents, of operators) are not published.
class PlayedBus {
 public:
  /// Error: the prefix gives an invalid channel name.
  static Result<PlayedBus> open(Bus& bus, const Scenario& scenario, const std::string& prefix);

  Status publish(const Message& message);
  std::uint64_t suppressed_commands() const { return suppressed_commands_; }  ///< commands

 private:
  PlayedBus(Bus& bus, std::string prefix) : bus_(&bus), prefix_(std::move(prefix)) {}
  bool is_command(const std::string& channel) const;

  Bus* bus_;
  std::string prefix_;
  std::set<std::string> commands_;  ///< names on the bus
  std::uint64_t suppressed_commands_ = 0;
};

}  // namespace parhelion::tools
