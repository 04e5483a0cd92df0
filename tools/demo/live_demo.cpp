#include "tools/demo/live_demo.hpp"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include "protocols/channels.hpp"
#include "server/runtime/loop.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/station/base_station.hpp"
#include "tools/demo/recorded_robot.hpp"
#include "tools/foxglove_option.hpp"
#include "tools/live_station.hpp"

namespace parhelion::tools {
namespace {

constexpr Duration kLead = seconds(1.0);  // before the robot's first message, so that the server has
                                          // subscribed

/// True for messages of a robot, not of people or the server.
bool is_robots(tick::InputKind kind) {
  switch (kind) {
    case tick::InputKind::scan:
    case tick::InputKind::odometry:
    case tick::InputKind::pose_cov:
    case tick::InputKind::pose:
    case tick::InputKind::imu:
    case tick::InputKind::camera:
    case tick::InputKind::depth:
    case tick::InputKind::lines:
    case tick::InputKind::joint_state:
      return true;
    default:
      return false;
  }
}

/// Publishes the robot's messages at their times, and notifies once the recording has ended.
class Speaker {
 public:
  Speaker(RecordedRobot robot, std::unique_ptr<Bus> bus, std::function<void(const std::string&)> notify)
      : robot_(std::move(robot)),
        bus_(std::move(bus)),
        notify_(std::move(notify)),
        thread_([this](const std::stop_token& stop) { run(stop); }) {}

 private:
  void run(const std::stop_token& stop) {
    std::mutex mutex;
    std::condition_variable_any never;
    std::unique_lock lock(mutex);
    bool stands = false;
    while (!stop.stop_requested()) {
      const auto message = robot_.next();
      if (!message) return;  // the server reports that the robot is silent
      if (robot_.stands() && !std::exchange(stands, true))
        notify_("real robot the recorded drive has ended: it stands from now on");
      const Duration left{message->arrival.ns - runtime::wall_now().ns};
      never.wait_for(lock, stop, std::chrono::nanoseconds(left.ns),
                     [&stop] { return stop.stop_requested(); });
      if (!stop.stop_requested()) (void)bus_->publish(message->channel, message->payload);
    }
  }

  RecordedRobot robot_;
  std::unique_ptr<Bus> bus_;
  std::function<void(const std::string&)> notify_;
  std::jthread thread_;
};

/// Forwards the server's messages to the network, except those to a robot, as there is none.
class Relay {
 public:
  Relay(std::unique_ptr<Bus> from, Bus& to)
      : from_(std::move(from)), to_(to), thread_([this](const std::stop_token& stop) { run(stop); }) {}

 private:
  void run(const std::stop_token& stop) {
    Message message;
    while (!stop.stop_requested()) {
      const auto came = from_->receive(message, milliseconds(100));
      if (!came) return;
      const bool command = message.channel == channel::kMrCmd || message.channel == channel::kMrJointCmd;
      if (*came && !command) (void)to_.publish(message.channel, message.payload);
    }
  }

  std::unique_ptr<Bus> from_;
  Bus& to_;
  std::jthread thread_;
};

/// Set when an instructor ends the session; a report follows.
struct DemoEnd {
  std::atomic<bool> asked = false, reported = false;
};

Result<std::unique_ptr<station::BaseStation>> open_station(const tick::Configuration& configuration,
                                                           const LiveDemoOptions& options, MemoryBusHub& hub,
                                                           DemoEnd& end) {
  station::BaseStationOptions base;
  base.address = options.http;
  base.folder = std::filesystem::path(options.folder) / "station";
  base.open_bus = [&hub] { return Result<std::unique_ptr<Bus>>(hub.connect()); };
  base.why_not_driven = "it is a recording: it drives as it was recorded, and then stands";
  station::StationOptions& station = base.station;
  station.configuration = std::make_shared<const tick::Configuration>(configuration);
  station.notes = std::filesystem::path(options.session).replace_extension(".notes.jsonl").string();
  station.scenarios = (base.folder / "scenarios").string();
  station.controls.end = [&end] {
    end.asked = true;
    return Status();
  };
  station.controls.state = [&end] {
    station::ControlState state;
    state.ended = end.reported;
    return state;
  };
  return station::BaseStation::open(std::move(base));
}

}  // namespace

Result<runtime::Report> serve_demo(const tick::Configuration& configuration, const LiveDemoOptions& options) {
  const tick::ChannelMap& channels = configuration.channels;
  auto robot = RecordedRobot::open(
      options.log, [&channels](const std::string& channel) { return is_robots(channels.kind(channel)); },
      channels.bus(channel::kScan), ArrivalTime{runtime::wall_now().ns} + kLead);
  if (!robot) return robot.error();
  MemoryBusHub hub;
  DemoEnd end;
  const auto server_bus = hub.connect();
  const auto station = open_station(configuration, options, hub, end);
  if (!station) return station.error();
  std::unique_ptr<station::FoxgloveServer> foxglove;
  if (!options.foxglove.empty()) {
    auto opened = open_foxglove(options.foxglove, hub.connect(), configuration);
    if (!opened) return opened.error();
    foxglove = std::move(*opened);
    options.notify("foxglove   " + foxglove->address());
  }
  std::optional<Relay> relay;
  if (options.bus != nullptr) {
    auto outputs = hub.connect();
    if (const Status subscribed = outputs->subscribe("MR_.*", 256); !subscribed) return subscribed.error();
    relay.emplace(std::move(outputs), *options.bus);
  }
  options.notify("open this  " + (*station)->link(station::Role::instructor, "instructor"));
  options.notify("trainee    " + (*station)->link(station::Role::trainee, "trainee"));
  options.notify("observer   " + (*station)->link(station::Role::observer, "observer"));
  options.notify("           each in a browser of its own, or in a private window; ^C ends it");
  if (configuration.scenario.training)
    options.notify(
        "           virtual robots wait for *Start the training* on the page, or until one is driven");
  std::mutex notifying;
  const auto notify = [&](const std::string& line) {
    const std::lock_guard lock(notifying);
    options.notify(line);
  };
  const Speaker speaker(std::move(*robot), hub.connect(), notify);
  runtime::ServeOptions serving;
  serving.session = options.session;
  serving.overwrite = options.overwrite;
  serving.stop = [&] { return end.asked || (options.stop && options.stop()); };
  auto report = runtime::serve(*server_bus, configuration, serving);
  if (!report) return report.error();
  if (!end.asked) return report;
  (*station)->end_driving();
  (*station)->set_report(session_report(*report, options.session));
  end.reported = true;
  notify("ended by the instructor; the page shows the report; stop with ^C");
  while (options.stop && !options.stop()) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  return report;
}

}  // namespace parhelion::tools
