#include "server/tick/foreign_publisher.hpp"

#include <algorithm>

#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"

namespace parhelion::tick {
namespace {

constexpr auto kFaults = static_cast<std::int64_t>(kSignatureFaults);

/// Inputs, then outputs, by their names on the bus.
std::vector<std::string> reported_channels(const Configuration& configuration) {
  std::vector<std::string> names = configuration.channels.inputs();
  for (std::size_t robot = 0; robot < configuration.robot_count(); ++robot) {
    for (const std::string& own : own_channels()) names.push_back(configuration.channels.bus(own, robot));
  }
  for (const LaserOutput& own : further_laser_outputs(configuration)) names.push_back(own.bus);
  return names;
}

void publish(const TickContext& context, const std::string& channel, std::string text) {
  Event event;
  event.stamp = context.now;
  event.kind = EventKind::foreign_publisher;
  event.subject = context.robot().name;
  event.object = channel;
  event.text = std::move(text);
  publish_event(context, event);
}

}  // namespace

const std::vector<std::string>& own_channels() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all = sensor_channels();
    for (const char* own : {channel::kMrStatus, channel::kMrScan, channel::kMrCmd, channel::kMrJointCmd})
      all.emplace_back(own);
    return all;
  }();
  return names;
}

std::vector<LaserOutput> further_laser_outputs(const Configuration& configuration) {
  const bool simulated = simulates_trainee(configuration.scenario);
  std::vector<LaserOutput> all;
  for (std::size_t robot = 0; robot < configuration.robot_count(); ++robot) {
    for (std::size_t laser = 1; laser <= configuration.robot_at(robot).further_lasers.size(); ++laser) {
      const auto bus = [&](const char* canonical) {
        return configuration.channels.robots_bus(canonical, robot, laser);
      };
      all.push_back({robot, bus(channel::kMrScan)});
      if (simulated) all.push_back({robot, bus(channel::kScan), true});
    }
  }
  return all;
}

std::int64_t status_channel_index() { return static_cast<std::int64_t>(sensor_channels().size()); }

std::int64_t refused_message_count(const Configuration& configuration, SignatureFault fault,
                                   std::string_view channel) {
  const std::vector<std::string> names = reported_channels(configuration);
  const auto index = std::find(names.begin(), names.end(), channel) - names.begin();
  return index * kFaults + static_cast<std::int64_t>(fault);
}

namespace {

void report_foreign_on(const TickContext& context, const std::string& name, bool simulated_sensor) {
  publish(context, name,
          "another publisher uses " + name +
              (simulated_sensor
                   ? ", a channel of the simulated robot's sensors; its messages are ignored"
                   : ", on which only this server may publish: the robot may act on it; authentication "
                     "(docs/security.md) keeps it out"));
}

void report_foreign_laser(const TickContext& context, std::size_t index) {
  const std::vector<LaserOutput> outputs = further_laser_outputs(context.configuration);
  if (index >= outputs.size()) return;
  const LaserOutput& output = outputs[index];
  report_foreign_on(context.of_robot(output.robot), output.bus, output.simulated_sensor);
}

}  // namespace

void report_foreign_message(const TickContext& context, std::int64_t channel) {
  const auto& names = own_channels();
  const auto count = static_cast<std::int64_t>(names.size());
  if (channel < 0) return;
  const auto robot = static_cast<std::size_t>(channel / count);
  if (robot >= context.configuration.robot_count())
    return report_foreign_laser(
        context, static_cast<std::size_t>(channel) - names.size() * context.configuration.robot_count());
  channel %= count;
  const std::string name =
      context.configuration.channels.bus(names[static_cast<std::size_t>(channel)], robot);
  if (channel == status_channel_index()) return publish(context, name, kOtherServerText);
  report_foreign_on(context.of_robot(robot), name, channel < status_channel_index());
}

void report_refused_message(const TickContext& context, std::int64_t count) {
  const std::vector<std::string> names = reported_channels(context.configuration);
  if (count < 0) return;
  const auto index = static_cast<std::size_t>(count / kFaults);
  const std::string name = index < names.size() ? names[index] : "another channel";
  publish(context, name,
          "a message on " + name + " was " + to_string(static_cast<SignatureFault>(count % kFaults)) +
              ": refused, and counted from now on");
}

}  // namespace parhelion::tick
