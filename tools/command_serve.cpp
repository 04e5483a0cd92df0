// parhelion serve: the live server, supervised by a parent process that restarts it if it dies.
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <thread>

#include "protocols/bus/network_speaker.hpp"
#include "server/runtime/crowd_time.hpp"
#include "server/runtime/grade_session.hpp"
#include "server/runtime/live_site.hpp"
#include "server/runtime/loop.hpp"
#include "server/runtime/session_files.hpp"
#include "server/station/http/web_site.hpp"
#include "server/station/tapped_bus.hpp"
#include "server/training/briefing.hpp"
#include "tools/command.hpp"
#include "tools/foxglove_option.hpp"
#include "tools/live_station.hpp"
#include "tools/stop_memory.hpp"
#include "tools/stop_signal.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

struct Arguments {
  std::string scenario, robot, session, report, url, http, cloud, state, foxglove;
  std::string real_time = "auto";
  bool overwrite = false;
  bool once = false;
};

Exit fail(const std::string& what) {
  std::fprintf(stderr, "parhelion serve: %s\n", what.c_str());
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

/// The log of a restarted server: beside the log of the one that died, which is kept unchanged.
std::string session_after(const std::string& session) {
  const std::filesystem::path path(session);
  return session_name((path.parent_path() / path.stem()).string());
}

Result<tick::Configuration> configuration_for(const Arguments& arguments, Bus& bus,
                                              const runtime::ServeOptions& options) {
  const auto files = runtime::load_session_files(arguments.scenario, arguments.robot);
  if (!files) return files.error();
  if (files->robot) return tick::configure(files->scenario, *files->robot, files->model, files->robot_models);
  const auto robot = runtime::wait_for_robot(bus, files->scenario, options);
  if (!robot) return robot.error();
  if (!*robot) return Error{"stopped before a robot description came"};
  return tick::configure(files->scenario, **robot, files->model, files->robot_models);
}

/// The network reader gets the same priority as the loop.
Result<std::unique_ptr<station::TappedBus>> open_tapped_bus(const std::string& url,
                                                            runtime::RealTime real_time) {
  auto speaker = open_network_speaker(url);
  if (!speaker) return speaker.error();
  const runtime::RealTimeScope scope(real_time);
  auto network = open_network_bus(url);
  if (!network) return network.error();
  return std::make_unique<station::TappedBus>(std::move(*network), std::move(*speaker));
}

/// After an instructor has ended the session: serves the report until the server is stopped.
void show_until_stopped(LiveStation& station, const runtime::Report& report, Bus& bus,
                        const runtime::ServeOptions& options) {
  station.show_report(report);
  options.notify("ended by the instructor; the base station shows the report; stop with ^C");
  Message message;  // the station receives what is received here
  while (!stop_asked()) {
    if (!bus.receive(message, milliseconds(100))) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
}

/// True if an emergency stop was active when the server died. Used if the state folder is not writable.
using SharedStop = std::atomic<bool>;

/// Initializes the stop state in `options` from `memory`, and stores its later changes there.
void remember_stops(runtime::ServeOptions& options, StopMemory& memory, SharedStop& shared) {
  options.robot_stopped = shared || memory.holds();
  options.robot_stop_held = [&memory, &shared, notify = options.notify](bool holds) {
    shared = holds;
    if (const Status kept = memory.keep(holds); !kept) notify("emergency stop: " + kept.error().message);
  };
}

Exit run_once(const Arguments& arguments, SharedStop& robot_stopped) {
  runtime::ServeOptions options;
  options.session = arguments.session;
  options.overwrite = arguments.overwrite;
  for (const std::string& path : {arguments.session, arguments.report}) {
    if (const Status writable = check_writable(path, arguments.overwrite); !writable)
      return fail(writable.error().message);
  }
  options.real_time = *runtime::parse_real_time(arguments.real_time);
  options.stop = stop_asked;
  options.notify = [](const std::string& news) {
    std::fprintf(stderr, "parhelion serve: %s\n", news.c_str());
  };
  auto bus = open_tapped_bus(arguments.url, options.real_time);
  if (!bus) return fail(bus.error().message);
  const auto configuration = configuration_for(arguments, **bus, options);
  if (!configuration) return stop_asked() ? Exit::done : fail(configuration.error().message);
  const auto state =
      arguments.state.empty() ? station::default_site_folder() : std::filesystem::path(arguments.state);
  StopMemory stop_memory(state, arguments.url, configuration->robot.name);
  remember_stops(options, stop_memory, robot_stopped);
  if (const auto slow = runtime::warn_of_slow_crowd(*configuration)) options.notify(*slow);
  std::fprintf(stderr, "parhelion serve: session log %s\n", options.session.c_str());
  if (configuration->scenario.training)
    std::fputs(training::briefing(configuration->scenario, tick::graded_robot(*configuration)).c_str(),
               stderr);
  if (configuration->scenario.mapping) {
    const auto site = std::make_shared<runtime::LiveSite>(configuration->model);
    options.update_site = [site](const runtime::SiteView& view) { return site->add(view); };
  }
  std::unique_ptr<LiveStation> station;
  if (!arguments.http.empty()) {
    auto opened = LiveStation::open(
        {arguments.http, arguments.state, [&bus] { return Result<std::unique_ptr<Bus>>((*bus)->tap()); },
         arguments.session, arguments.cloud, options.robot_stopped},
        *configuration);
    if (!opened) return fail(opened.error().message);
    station = std::move(*opened);
    options.notify(station->invitation());
    options.clock = station->clock();
    options.stop = [it = station.get()] { return stop_asked() || it->ended(); };
  }
  std::unique_ptr<station::FoxgloveServer> foxglove;
  if (!arguments.foxglove.empty()) {
    auto shown = open_network_bus(arguments.url);
    if (!shown) return fail(shown.error().message);
    auto opened = open_foxglove(arguments.foxglove, std::move(*shown), *configuration);
    if (!opened) return fail(opened.error().message);
    foxglove = std::move(*opened);
    options.notify("for Foxglove, without log-in: " + foxglove->address());
  }
  const auto report = runtime::serve(**bus, *configuration, options);
  if (!report) return fail(report.error().message);
  // A simulated robot ends with its session; a real one is still there.
  if (tick::simulates_trainee(configuration->scenario)) (void)stop_memory.keep(false);
  std::fputs(runtime::summary(*report).c_str(), stderr);
  if (!arguments.report.empty()) {
    if (const Status written = write_text(arguments.report, to_json(*report), arguments.overwrite);
        !written) {
      return fail(written.error().message);
    }
  }
  if (station && station->ended()) show_until_stopped(*station, *report, **bus, options);
  return report->complete ? Exit::done : Exit::failed;
}

volatile std::sig_atomic_t child = 0;
volatile std::sig_atomic_t asked_to_stop = 0;
void pass_on(int signal) {
  asked_to_stop = 1;
  if (child > 0) kill(child, signal);
}

/// Holds back signals while a server process starts, so that none is lost.
class HeldSignals {
 public:
  HeldSignals() {
    sigset_t both;
    sigemptyset(&both);
    sigaddset(&both, SIGINT);
    sigaddset(&both, SIGTERM);
    sigprocmask(SIG_BLOCK, &both, &before_);
  }
  ~HeldSignals() { sigprocmask(SIG_SETMASK, &before_, nullptr); }
  HeldSignals(const HeldSignals&) = delete;
  HeldSignals& operator=(const HeldSignals&) = delete;

 private:
  sigset_t before_{};
};

/// In the new process: the server. In this one: its id, or nothing if it could not be created.
pid_t start_server() {
  const HeldSignals held;
  const pid_t made = fork();
  if (made != 0) {
    child = std::max(made, 0);
    if (child > 0 && asked_to_stop != 0) kill(child, SIGTERM);
    return made;
  }
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  catch_stop_signals();
  return 0;
}

/// Memory shared by this process and its children.
SharedStop* shared_stop_memory() {
  void* memory = mmap(nullptr, sizeof(SharedStop), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  return memory == MAP_FAILED ? nullptr : new (memory) SharedStop(false);
}

/// Restarts a server that dies, at once (promise 2: within a second). Does not restart one that exits by
/// itself or that dies after it was requested to stop.
Exit supervise(Arguments arguments) {
  std::signal(SIGINT, pass_on);
  std::signal(SIGTERM, pass_on);
  SharedStop* robot_stopped = shared_stop_memory();
  if (robot_stopped == nullptr) return fail("no memory to share with the server process");
  while (true) {
    const pid_t server = start_server();
    if (server < 0) return fail("cannot start the server process");
    if (server == 0) {
      const Exit exit = run_once(arguments, *robot_stopped);
      std::fflush(nullptr);
      _exit(static_cast<int>(exit));
    }
    int status = 0;
    while (waitpid(server, &status, 0) < 0) {
    }
    child = 0;
    if (WIFEXITED(status)) return static_cast<Exit>(WEXITSTATUS(status));
    const std::string how = "the server died (signal " + std::to_string(WTERMSIG(status)) + ")";
    if (asked_to_stop != 0) return fail(how + " while it was stopping; its session log has no end");
    std::fprintf(stderr, "parhelion serve: %s; starting it again\n", how.c_str());
    arguments.session = session_after(arguments.session);
  }
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
  command->add_option("--url", arguments->url, "LCM URL; by default LCM_DEFAULT_URL, else this machine only");
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
  command->add_option("--foxglove", arguments->foxglove,
                      "ADDR:PORT (usually 8765) of a server for Foxglove and Lichtblick");
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
    if (!arguments->once) {
      exit = supervise(*arguments);
      return;
    }
    catch_stop_signals();
    SharedStop robot_stopped = false;
    exit = run_once(*arguments, robot_stopped);
  });
}

}  // namespace parhelion::tools
