// parhelion serve: the live server, supervised by a parent process that restarts it if it dies.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <memory>
#include <thread>

#include "protocols/bus/multicast_group.hpp"
#include "protocols/bus/shared_bus.hpp"
#include "protocols/codec.hpp"
#include "server/runtime/crowd_time.hpp"
#include "server/runtime/grade_session.hpp"
#include "server/runtime/live_site.hpp"
#include "server/runtime/loop.hpp"
#include "server/runtime/session_files.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/station/http/private_file.hpp"
#include "server/station/http/web_site.hpp"
#include "server/tick/robot_descriptions.hpp"
#include "server/training/briefing.hpp"
#include "tools/bus_options.hpp"
#include "tools/command.hpp"
#include "tools/foxglove_option.hpp"
#include "tools/live_station.hpp"
#include "tools/service/service_log.hpp"
#include "tools/service/service_manager.hpp"
#include "tools/stop_memory.hpp"
#include "tools/stop_signal.hpp"
#include "tools/supervision.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

struct Arguments {
  std::string scenario, robot, session, report, http, cloud, state, foxglove;
  BusOptions bus;
  std::string real_time = "auto";
  bool overwrite = false;
  bool once = false;
};

Exit fail(const std::string& what) {
  log_line(Priority::error, what);
  return Exit::failed;
}

/// An unused name, since sessions are never overwritten: "<stem>-<time>-<process>.lcm".
std::string session_name(const std::string& stem) {
  char text[64];
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::strftime(text, sizeof text, "-%Y%m%dT%H%M%SZ-", &utc);
  return stem + text + std::to_string(getpid()) + ".lcm";
}

/// A restarted server uses the descriptions that the one before it had: a robot may send its own seldom.
Result<std::optional<std::vector<RobotDescription>>> robots_for(const runtime::SessionFiles& files, Bus& bus,
                                                                const runtime::ServeOptions& options,
                                                                ServerMemory& memory) {
  if (const std::string known = memory.robot(); !known.empty()) {
    auto robots = tick::parse_robot_descriptions(known, "the previous server's robot description");
    if (robots && robots->size() == files.robots.size()) return std::optional(std::move(*robots));
  }
  auto robots = runtime::wait_for_robots(bus, files.scenario, files.robots, options);
  if (robots && *robots) memory.set_robot(tick::to_yaml_documents(**robots));
  return robots;
}

Result<runtime::SessionFiles> load_files(const Arguments& arguments) {
  auto files = runtime::load_session_files(arguments.scenario, arguments.robot);
  if (files && files->scenario.authentication && arguments.bus.keys.empty()) {
    return Error{arguments.scenario +
                 ": authentication: sign needs --keys FILE; `parhelion key new` makes them"};
  }
  return files;
}

Result<tick::Configuration> configuration_for(const runtime::SessionFiles& files, Bus& bus,
                                              const std::string& scenario,
                                              const runtime::ServeOptions& options, ServerMemory& memory) {
  for (const auto& model : files.robot_models) {
    for (const std::string& warning : model->warnings) options.notify("warning: " + warning);
  }
  auto robots = robots_for(files, bus, options, memory);
  if (!robots) return robots.error();
  if (!*robots) return Error{"stopped before a robot description came"};
  tick::RobotModels models = files.robot_models;
  if (const Status added = runtime::add_models_of(**robots, scenario, runtime::DescribedBy::bus, models);
      !added)
    return added.error();
  return tick::configure_robots(files.scenario, std::move(**robots), files.model, std::move(models),
                                files.map, files.objects);
}

/// The network reader gets the same priority as the loop.
Result<std::unique_ptr<SharedBus>> open_bus(const BusOptions& options, OtherHosts hosts,
                                            runtime::RealTime real_time, runtime::RefusedMessages& refused) {
  auto speaker = options.open_speaker();
  if (!speaker) return speaker.error();
  const runtime::RealTimeScope scope(real_time);
  auto network =
      options.open([&refused](const RefusedMessage& message) { refused.add(message); }, std::move(hosts));
  if (!network) return network.error();
  return std::make_unique<SharedBus>(std::move(*network), std::move(*speaker));
}

/// After an instructor has ended the session: serves the report until the server is stopped.
void show_until_stopped(LiveStation& station, const runtime::Report& report, Bus& bus,
                        const runtime::ServeOptions& options, ServiceManager& manager) {
  station.show_report(report);
  options.notify("ended by the instructor; the base station shows the report; stop with ^C");
  Message message;  // the station receives what is received here
  while (!stop_asked()) {
    if (!bus.receive(message, milliseconds(100))) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  manager.stopping();
}

/// The emergency stops of the session's robots, in its order.
using StopMemories = std::vector<std::unique_ptr<StopMemory>>;

/// Initializes the stop state in `options` from `memories`, and stores its later changes there.
void remember_stops(const tick::Configuration& configuration, const StopMemories& memories,
                    ServerMemory& shared, runtime::ServeOptions& options) {
  for (std::size_t i = 0; i < memories.size(); ++i) {
    if (memories[i]->holds() || (shared.robots_stopped >> i & 1U) != 0)
      options.stopped_robots.push_back(configuration.robot_at(i).name);
  }
  options.robot_stop_held = [&](const std::string& robot, bool holds) {
    const std::size_t i = *configuration.find_robot(robot);
    const std::uint32_t bit = std::uint32_t{1} << i;
    holds ? shared.robots_stopped |= bit : shared.robots_stopped &= ~bit;
    if (const Status kept = memories[i]->keep(holds); !kept)
      log_line(Priority::warning, "emergency stop: " + kept.error().message);
  };
}

/// What the loop reports to people and to the service manager.
void report_state(runtime::ServeOptions& options, ServiceManager& manager) {
  options.notify = [&manager](const std::string& news) {
    log_line(Priority::information, news);
    manager.status(news);
  };
  options.loop_runs = [&manager] { manager.loop_runs(); };
  options.loop_ended = [&manager] { stop_asked() ? manager.stopping() : manager.loop_ended(); };
}

/// Who can send to the server, besides its own machine's programs.
void warn_of_open_bus(const Arguments& arguments, runtime::ServeOptions& options) {
  const auto group = parse_lcm_url(chosen_lcm_url(arguments.bus.url));
  options.open_bus = arguments.bus.keys.empty() && group && !group->this_machine_only;
  if (options.open_bus)
    options.notify(
        "other machines can send on this bus, and nothing is signed: anyone in the network can move the "
        "robot; see docs/security.md");
}

/// The stops that were active when an earlier server ended, and the file of each robot's. Error: the folder
/// is not private, at the first start.
Result<StopMemories> prepare_stops(const Arguments& arguments, const tick::Configuration& configuration,
                                   ServerMemory& memory, runtime::ServeOptions& options) {
  const auto folder =
      arguments.state.empty() ? station::default_site_folder() : std::filesystem::path(arguments.state);
  if (const Status safe = station::check_private_folder(folder); !safe) {
    if (!memory.begun) return safe.error();
    log_line(Priority::warning, safe.error().message);  // a restarted server serves nevertheless
  }
  StopMemories memories;
  for (std::size_t i = 0; i < configuration.robot_count(); ++i)
    memories.push_back(
        std::make_unique<StopMemory>(folder, bus_address(arguments.bus.url), configuration.robot_at(i).name));
  for (const std::string& stop : active_stops(folder)) options.notify(stop);
  return memories;
}

/// What people read before the start.
void announce(const tick::Configuration& configuration, const runtime::ServeOptions& options) {
  if (const auto slow = runtime::warn_of_slow_crowd(configuration)) log_line(Priority::warning, *slow);
  if (const auto note = runtime::note_without_model(configuration)) log_line(Priority::information, *note);
  log_line(Priority::information, "session log " + options.session);
  if (configuration.scenario.training)
    std::fputs(training::briefing(configuration.scenario, tick::graded_robots(configuration)).c_str(),
               stderr);
}

/// The base station; nullptr: none is asked for. `bus` must outlive it.
Result<std::unique_ptr<LiveStation>> open_station(const Arguments& arguments,
                                                  const runtime::SessionFiles& files,
                                                  const tick::Configuration& configuration, SharedBus& bus,
                                                  runtime::ServeOptions& options) {
  if (arguments.http.empty()) return std::unique_ptr<LiveStation>();
  auto station = LiveStation::open(
      {arguments.http, arguments.state, [&bus] { return Result<std::unique_ptr<Bus>>(bus.connect()); },
       arguments.session, arguments.cloud, files.texture, options.stopped_robots},
      configuration);
  if (!station) return station.error();
  log_line(Priority::information, (*station)->invitation());  // not for the manager: it has a secret link
  options.clock = (*station)->clock();
  options.stop = [it = station->get()] { return stop_asked() || it->ended(); };
  return std::move(*station);
}

/// The server for Foxglove; nullptr: none is asked for. Accepts the same senders as the loop.
Result<std::unique_ptr<station::FoxgloveServer>> open_foxglove_server(
    const Arguments& arguments, const runtime::SessionFiles& files,
    const tick::Configuration& configuration) {
  if (arguments.foxglove.empty()) return std::unique_ptr<station::FoxgloveServer>();
  auto shown = arguments.bus.open([](const RefusedMessage&) {}, OtherHosts{files.scenario.hosts, nullptr});
  if (!shown) return shown.error();
  auto server = open_foxglove(arguments.foxglove, std::move(*shown), configuration);
  if (!server) return server.error();
  log_line(Priority::information, "for Foxglove, without log-in: " + (*server)->address());
  return std::move(*server);
}

Status write_report(const Arguments& arguments, const runtime::Report& report) {
  std::fputs(runtime::summary(report).c_str(), stderr);
  return arguments.report.empty() ? Status()
                                  : write_text(arguments.report, to_json(report), arguments.overwrite);
}

Exit run_once(const Arguments& arguments, ServerMemory& memory, ServiceManager& manager) {
  runtime::ServeOptions options;
  options.session = arguments.session;
  options.overwrite = arguments.overwrite;
  for (const std::string& path : {arguments.session, arguments.report}) {
    if (const Status writable = check_writable(path, arguments.overwrite); !writable)
      return fail(writable.error().message);
  }
  options.real_time = *runtime::parse_real_time(arguments.real_time);
  options.stop = stop_asked;
  report_state(options, manager);
  const auto files = load_files(arguments);
  if (!files) return fail(files.error().message);
  options.texture = files->texture;
  if (files->texture)
    options.notify("simulated cameras show the site as recorded: " + texture_beside(files->scenario.model));
  runtime::RefusedMessages refused;
  if (!arguments.bus.keys.empty()) options.refused = &refused;
  runtime::RefusedHosts refused_hosts;
  options.refused_hosts = &refused_hosts;
  auto bus = open_bus(
      arguments.bus, {files->scenario.hosts, [&refused_hosts](const auto& host) { refused_hosts.add(host); }},
      options.real_time, refused);
  if (!bus) return fail(bus.error().message);
  warn_of_open_bus(arguments, options);
  const auto configuration = configuration_for(*files, **bus, arguments.scenario, options, memory);
  if (!configuration) return stop_asked() ? Exit::done : fail(configuration.error().message);
  const auto stop_memories = prepare_stops(arguments, *configuration, memory, options);
  if (!stop_memories) return fail(stop_memories.error().message);
  remember_stops(*configuration, *stop_memories, memory, options);
  options.begun = [&memory] { memory.begun = true; };
  options.commanded = [&memory](const auto& stops) { memory.set_robot_stops(stops); };
  announce(*configuration, options);
  if (configuration->scenario.mapping) {
    const auto site = std::make_shared<runtime::LiveSite>(configuration->model);
    options.update_site = [site](const runtime::SiteView& view) { return site->add(view); };
  }
  const auto station = open_station(arguments, *files, *configuration, **bus, options);
  if (!station) return fail(station.error().message);
  const auto foxglove = open_foxglove_server(arguments, *files, *configuration);
  if (!foxglove) return fail(foxglove.error().message);
  const auto report = runtime::serve(**bus, *configuration, options);
  if (*station) (*station)->end_driving();
  if (!report) return fail(report.error().message);
  memory.ended = true;
  // A simulated robot ends with its session; a real one is still there.
  if (tick::simulates_trainee(configuration->scenario)) (void)stop_memories->front()->keep(false);
  if (const Status written = write_report(arguments, *report); !written) return fail(written.error().message);
  if (*station && (*station)->ended()) show_until_stopped(**station, *report, **bus, options, manager);
  return report->complete ? Exit::done : Exit::failed;
}

/// Three times, as a datagram may be lost.
void stop_robot(const BusOptions& options, const runtime::RobotStop& stop) {
  const auto bus = options.open_speaker();
  for (int i = 0; bus && i < 3; ++i) {
    if (i > 0) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const SensorTime now{runtime::wall_now().ns};
    std::vector<std::uint8_t> payload;
    encode(TwistCommand{now, {}, stop.command_type}, payload);
    (void)(*bus)->publish(stop.command_channel, payload);
    if (stop.joints.empty()) continue;
    encode(Joints{now, stop.joints, {}, std::vector<double>(stop.joints.size(), 0), {}}, payload);
    (void)(*bus)->publish(stop.joint_channel, payload);
  }
}

Exit supervise_server(const Arguments& arguments, ServiceManager& manager) {
  Supervision supervision;
  supervision.serve = [arguments, &manager](int attempt, ServerMemory& memory) {
    Arguments now = arguments;
    if (attempt > 0) now.session = session_after(arguments.session);
    return run_once(now, memory, manager);
  };
  supervision.stop_robot = [bus = arguments.bus](const runtime::RobotStop& stop) { stop_robot(bus, stop); };
  supervision.notify = [&manager](const std::string& news) {
    log_line(Priority::error, news);
    manager.status(news);
  };
  return supervise(supervision);
}

}  // namespace

void add_serve(CLI::App& app, Exit& exit) {
  CLI::App* command = app.add_subcommand("serve", "Run the live server on LCM");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("scenario", arguments->scenario, "Scenario file")->required();
  command->add_option("--robot", arguments->robot, "Robot description; without it from the ROBOT channel");
  command->add_option("-o,--output", arguments->session, "Session log; by default session-<time>.lcm here");
  command->add_option("--report", arguments->report,
                      "JSON report to write at the end; - for standard output");
  arguments->bus.add_to(*command);
  CLI::Option* http = command->add_option(
      "--http", arguments->http, "Base station for browsers at ADDR:PORT, as 127.0.0.1:8080 or [::]:8443");
  command
      ->add_option("--cloud", arguments->cloud,
                   "The cloud that the model was built from: a layer of the page's 3D view")
      ->needs(http);
  command->add_option(
      "--state-folder", arguments->state,
      "Folder for active emergency stops, and accounts, certificate and saved scenarios of the base "
      "station; by default "
      "$XDG_STATE_HOME/parhelion");
  command->add_option(
      "--foxglove", arguments->foxglove,
      "ADDR:PORT (usually 8765) of a server for Foxglove and Lichtblick; further pages that may read it: "
      "ADDR:PORT,ORIGIN,...");
  command
      ->add_option("--real-time", arguments->real_time,
                   "Real-time priority (SCHED_FIFO) for the scan path: on, off, or "
                   "auto, if permitted")
      ->check(CLI::IsMember({"auto", "on", "off"}))
      ->capture_default_str();
  command->add_flag("--force", arguments->overwrite, "Overwrite files that exist");
  command->add_flag("--no-restart", arguments->once, "Do not restart the server if it dies");
  command->footer(
      "Example: parhelion serve lab.yaml -o session.lcm\n"
      "         parhelion serve lab.yaml --http 127.0.0.1:8080    (open the link that it prints)");
  command->callback([arguments, &exit] {
    if (arguments->session.empty()) arguments->session = session_name("session");
    auto manager = ServiceManager::from_environment();
    if (!manager) {
      exit = fail(manager.error().message);
      return;
    }
    if (!arguments->once) {
      exit = supervise_server(*arguments, *manager);
      return;
    }
    catch_stop_signals();
    const auto memory = std::make_unique<ServerMemory>();
    exit = run_once(*arguments, *memory, *manager);
  });
}

}  // namespace parhelion::tools
