#include "server/runtime/loop.hpp"

#include "protocols/bus/log_file.hpp"
#include "server/runtime/live_session.hpp"

namespace parhelion::runtime {
namespace {

constexpr Duration kIdle = milliseconds(100);

}  // namespace

Result<std::optional<RobotDescription>> wait_for_robot(Bus& bus, const Scenario& scenario,
                                                       const ServeOptions& options) {
  const std::string name = tick::ChannelMap(scenario).bus(channel::kRobot);
  if (const Status subscribed = bus.subscribe(name, 1); !subscribed) return subscribed.error();
  if (options.notify)
    options.notify("waiting for the robot description on " + name + " (or give --robot FILE)");
  std::string reported;
  const auto report = [&](const std::string& what) {
    if (options.notify && what != reported) options.notify(what + "; still waiting");
    reported = what;
  };
  while (!options.stop || !options.stop()) {
    Message message;
    const auto received = bus.receive(message, kIdle);
    if (!received) return received.error();
    if (!*received) continue;
    RobotMessage robot;
    if (const Status read = decode(message.channel, message.payload, robot); !read) {
      report(read.error().message);
      continue;
    }
    auto description = parse_robot_description(robot.yaml, name);
    if (description) return std::optional(std::move(*description));
    report(description.error().message);
  }
  return std::optional<RobotDescription>{};
}

Result<Report> serve(Bus& bus, const tick::Configuration& configuration, const ServeOptions& options) {
  for (const std::string& input : configuration.channels.inputs()) {
    const tick::InputKind kind = configuration.channels.kind(input);
    if (kind == tick::InputKind::loop || kind == tick::InputKind::robot || kind == tick::InputKind::model)
      continue;  // the server's own, read before the start
    const bool newest_only = kind == tick::InputKind::teleop || kind == tick::InputKind::camera;
    if (const Status subscribed = bus.subscribe(input, newest_only ? 1 : 64); !subscribed)
      return subscribed.error();
  }
  // Subscribed only to detect other publishers.
  const SentMessages own_messages(configuration);
  for (const std::string& own : own_messages.channels()) {
    if (const Status subscribed = bus.subscribe(own, 64); !subscribed) return subscribed.error();
  }
  std::optional<LogWriter> log;
  if (!options.session.empty()) {
    auto created = LogWriter::create(options.session, options.overwrite);
    if (!created) return created.error();
    log = std::move(*created);
  }
  return LiveSession(bus, configuration, options, std::move(log))();
}

}  // namespace parhelion::runtime
