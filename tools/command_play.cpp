// parhelion play: plays a recording.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <optional>
#include <thread>

#include "server/station/console/terminal.hpp"
#include "tools/bus_options.hpp"
#include "tools/foxglove_option.hpp"
#include "tools/play/play_keys.hpp"
#include "tools/play/play_station.hpp"
#include "tools/play/play_thread.hpp"
#include "tools/play/played_bus.hpp"
#include "tools/play_commands.hpp"
#include "tools/progress.hpp"
#include "tools/stop_signal.hpp"

namespace parhelion::tools {
namespace {

constexpr Duration kLook = milliseconds(100);  // polling interval of keys and end

struct Arguments {
  std::string log, http, foxglove, prefix = "PLAY_";
  BusOptions bus;
  runtime::PlayOptions options;
  bool publish = false;
};

Exit fail(const std::string& what) {
  std::fprintf(stderr, "parhelion play: %s\n", what.c_str());
  return Exit::failed;
}

Result<runtime::Recording> open_recording(const std::string& path) {
  Progress progress("open", "MB");
  auto recording = runtime::Recording::open(path, [&](std::uint64_t done, std::uint64_t total) {
    progress.update(static_cast<double>(done) / 1e6, static_cast<double>(total) / 1e6);
    return !stop_asked();
  });
  progress.finish();
  return recording;
}

void report_damage(const runtime::Recording& recording, const std::string& log) {
  const std::vector<std::string> findings = recording.findings();
  for (const std::string& finding : findings) std::fprintf(stderr, "parhelion play: %s\n", finding.c_str());
  if (!findings.empty())
    std::fprintf(
        stderr,
        "parhelion play: %llu bytes are damaged and left out; check the log with `parhelion validate "
        "%s`\n",
        static_cast<unsigned long long>(recording.skipped_bytes()), log.c_str());
}

Result<std::unique_ptr<station::FoxgloveServer>> show_in_foxglove(const std::string& address,
                                                                  const runtime::Player& player,
                                                                  MemoryBusHub& hub) {
  const auto configuration = tick::configuration_from(player.recording().session(), "the recording");
  if (!configuration) return configuration.error();
  return open_foxglove(address, hub.connect(), *configuration, [&player] { return player.clock(); });
}

/// Returns when a key or ^C ends it, or at the end of the recording unless `stays`, when clients may still
/// look.
std::string watch(runtime::Player& player, PlayThread& thread, station::RawTerminal* terminal, bool stays) {
  PlayKeys keys(player);
  while (!stop_asked() && !keys.quit()) {
    if (const std::string fault = thread.fault(); !fault.empty()) return fault;
    if (player.state().ended && !stays) break;
    if (terminal == nullptr) {
      std::this_thread::sleep_for(std::chrono::nanoseconds(kLook.ns));
      continue;
    }
    const auto typed = terminal->read(kLook);
    if (!typed) return typed.error().message;
    keys.feed(*typed);
    if (!typed->empty()) thread.wake();
    if (keys.take_help()) std::printf("\r\033[K%s", play_help());
    std::printf("\r\033[K%s", play_line(player.state()).c_str());
    std::fflush(stdout);
  }
  if (terminal != nullptr) std::printf("\n");
  return {};
}

Exit run(Arguments& arguments) {
  catch_stop_signals();
  auto recording = open_recording(arguments.log);
  if (!recording) return fail(recording.error().message);
  report_damage(*recording, arguments.log);
  if (arguments.options.start > recording->duration())
    return fail("--start-offset " + std::to_string(arguments.options.start) + " s; the recording is " +
                std::to_string(recording->duration()) + " s long");
  const auto scenario =
      parse_scenario(recording->session().scenario_yaml, arguments.log + " (MR_SESSION scenario)");
  if (!scenario) return fail(scenario.error().message);
  std::unique_ptr<Bus> network;
  std::optional<PlayedBus> played;
  if (arguments.publish) {
    auto opened = arguments.bus.open_speaker();
    if (!opened) return fail(opened.error().message);
    network = std::move(*opened);
    auto guarded = PlayedBus::open(*network, *scenario, arguments.prefix);
    if (!guarded) return fail(guarded.error().message);
    played = std::move(*guarded);
  }
  MemoryBusHub hub;
  const auto shown = hub.connect();
  runtime::Player player(std::move(*recording), arguments.options, [&](const Message& message) {
    (void)shown->publish(message.channel, message.payload);
    if (played) (void)played->publish(message);
  });
  PlayThread thread(player);
  std::unique_ptr<station::BaseStation> station;
  if (!arguments.http.empty()) {
    auto opened = open_play_station(arguments.http, hub, player, thread);
    if (!opened) return fail(opened.error().message);
    station = std::move(*opened);
    std::printf("%s\n", station->link(station::Role::instructor, "guest").c_str());
  }
  std::unique_ptr<station::FoxgloveServer> foxglove;
  if (!arguments.foxglove.empty()) {
    auto opened = show_in_foxglove(arguments.foxglove, player, hub);
    if (!opened) return fail(opened.error().message);
    foxglove = std::move(*opened);
    std::printf("%s\n", foxglove->address().c_str());
  }
  std::unique_ptr<station::RawTerminal> terminal;
  if (isatty(STDIN_FILENO) == 1 && isatty(STDOUT_FILENO) == 1) {
    auto opened = station::RawTerminal::open(STDIN_FILENO);
    if (!opened) return fail(opened.error().message);
    terminal = std::move(*opened);
    std::printf("%s", play_help());
  }
  std::fflush(stdout);
  thread.start();
  const std::string fault = watch(player, thread, terminal.get(), station || foxglove);
  if (!fault.empty()) return fail(fault);
  if (played && played->suppressed_commands() > 0)
    std::fprintf(stderr, "parhelion play: %llu commands were not published (no prefix)\n",
                 static_cast<unsigned long long>(played->suppressed_commands()));
  return Exit::done;
}

}  // namespace

void add_play(CLI::App& app, Exit& exit) {
  CLI::App* command = app.add_subcommand("play", "Play a recorded session; pause, seek, loop");
  auto arguments = std::make_shared<Arguments>();
  runtime::PlayOptions& options = arguments->options;
  command->add_option("log", arguments->log, "Session log, as serve and replay -o write it")->required();
  command->add_option("--rate", options.rate, "Times real time")
      ->check(CLI::Range(runtime::Player::kSlowest, runtime::Player::kFastest))
      ->capture_default_str();
  command->add_option("--start-offset", options.start, "Start time in the session, s")
      ->check(CLI::NonNegativeNumber);
  command->add_flag("--loop", options.loop, "Restart at the end");
  command->add_flag("--paused", options.paused, "Start paused");
  command->add_option("--http", arguments->http,
                      "Base station for browsers at ADDR:PORT, as 127.0.0.1:8080: a page with a seek bar");
  command->add_option(
      "--foxglove", arguments->foxglove,
      "ADDR:PORT (usually 8765) of a server for Foxglove and Lichtblick; further pages that may read it: "
      "ADDR:PORT,ORIGIN,...");
  auto* publish = command->add_flag("--publish", arguments->publish,
                                    "Publish on LCM too: each channel with the prefix before its name");
  command
      ->add_option("--prefix", arguments->prefix,
                   "Prefix of the channels; empty: their own names, without commands")
      ->needs(publish)
      ->capture_default_str();
  arguments->bus.add_to(*command);
  command->get_option("--url")->needs(publish);
  command->footer(
      "Example:\n  parhelion play session.lcm\n  parhelion play session.lcm --http 127.0.0.1:8080\n  "
      "parhelion play session.lcm --publish --rate 2 --loop\n\n" +
      std::string(play_help()));
  command->callback([arguments, &exit] { exit = run(*arguments); });
}

}  // namespace parhelion::tools
