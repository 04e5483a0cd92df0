#include "server/runtime/loop.hpp"

#include "protocols/bus/log_file.hpp"
#include "server/runtime/live_session.hpp"

namespace parhelion::runtime {
namespace {

constexpr Duration kIdle = milliseconds(100);
constexpr Duration kAskAgain = seconds(10.0);

constexpr int kCommands = 4 * 1024;  // more than an inbox keeps, which refuses the excess with a reply

/// Messages of a channel that wait on the bus until the inbox receives them. The bus drops the oldest without
/// a reply.
int capacity_of(tick::InputKind kind) {
  switch (kind) {
    case tick::InputKind::teleop:
    case tick::InputKind::camera:
      return 1;  // the newest alone counts
    case tick::InputKind::command:
    case tick::InputKind::emergency_stop:
      return kCommands;
    default:
      return 64;
  }
}

}  // namespace

Result<std::optional<std::vector<RobotDescription>>> wait_for_robots(
    Bus& bus, const Scenario& scenario, std::vector<std::optional<RobotDescription>> known,
    const ServeOptions& options) {
  const tick::ChannelMap channels(scenario);
  const auto missing = [&] {
    std::string names;
    for (std::size_t i = 0; i < known.size(); ++i) {
      if (!known[i]) names += (names.empty() ? "" : ", ") + channels.bus(channel::kRobot, i);
    }
    return names;
  };
  for (std::size_t i = 0; i < known.size(); ++i) {
    if (known[i]) continue;
    if (const Status subscribed = bus.subscribe(channels.bus(channel::kRobot, i), 1); !subscribed)
      return subscribed.error();
  }
  std::string reported;
  const auto report = [&](const std::string& what) {
    if (options.notify && what != reported) options.notify(what);
    reported = what;
  };
  const std::string hint = known.size() == 1 ? " (or give --robot FILE)" : " (or give 'description: FILE')";
  WallTime asked = steady_now();
  for (std::string left = missing(); !left.empty(); left = missing()) {
    report("waiting for the robot description on " + left + hint);
    if (options.stop && options.stop()) return std::optional<std::vector<RobotDescription>>{};
    if (steady_now() - asked > kAskAgain) {
      asked = steady_now();
      reported.clear();
    }
    Message message;
    const auto received = bus.receive(message, kIdle);
    if (!received) return received.error();
    std::size_t robot = 0;
    if (!*received || channels.kind(message.channel, nullptr, &robot) != tick::InputKind::robot) continue;
    RobotMessage text;
    if (const Status read = decode(message.channel, message.payload, text); !read) {
      report(read.error().message + "; still waiting");
      continue;
    }
    auto description = parse_robot_description(text.yaml, message.channel);
    if (description) {
      known[robot] = std::move(*description);
    } else {
      report(description.error().message + "; still waiting");
    }
  }
  std::vector<RobotDescription> all;
  for (auto& each : known) all.push_back(std::move(*each));
  return std::optional(std::move(all));
}

Result<Report> serve(Bus& bus, const tick::Configuration& configuration, const ServeOptions& options) {
  for (const std::string& input : configuration.channels.inputs()) {
    const tick::InputKind kind = configuration.channels.kind(input);
    if (kind == tick::InputKind::loop || kind == tick::InputKind::robot || kind == tick::InputKind::model)
      continue;  // the server's own, read before the start
    if (const Status subscribed = bus.subscribe(input, capacity_of(kind)); !subscribed)
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
