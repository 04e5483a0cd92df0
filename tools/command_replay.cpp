// parhelion replay: runs the same server over a recorded log.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "server/runtime/replay.hpp"
#include "tools/bus_options.hpp"
#include "tools/command.hpp"
#include "tools/progress.hpp"
#include "tools/stop_signal.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

struct Arguments {
  runtime::ReplayOptions options;
  std::string scenario, robot, report, texture;
  BusOptions bus;
  std::uint64_t seed = 0;
  bool publish = false;
};

Exit fail(const std::string& what) {
  std::fprintf(stderr, "parhelion replay: %s\n", what.c_str());
  return Exit::failed;
}

Exit run(Arguments& arguments, const CLI::App& command) {
  catch_stop_signals();
  runtime::ReplayOptions& options = arguments.options;
  for (const std::string& path : {options.session, arguments.report}) {
    if (const Status writable = check_writable(path, options.overwrite); !writable)
      return fail(writable.error().message);
  }
  if (!arguments.scenario.empty()) options.scenario = arguments.scenario;
  if (!arguments.robot.empty()) options.robot = arguments.robot;
  if (!arguments.texture.empty()) options.texture = arguments.texture;
  if (command.count("--seed") > 0) options.seed = arguments.seed;
  std::unique_ptr<Bus> bus;
  if (arguments.publish || !arguments.bus.url.empty()) {
    auto opened = arguments.bus.open_speaker();
    if (!opened) return fail(opened.error().message);
    bus = std::move(*opened);
    options.bus = bus.get();
  }
  Progress progress("replay", "MB");
  options.progress = [&](const runtime::ReplayProgress& at) {
    progress.update(static_cast<double>(at.bytes_done) / 1e6, static_cast<double>(at.bytes_total) / 1e6);
  };
  options.stop = stop_asked;
  const auto report = runtime::replay(options);
  progress.finish();
  if (!report) return fail(report.error().message);
  std::fputs(runtime::summary(*report).c_str(), stderr);
  if (!arguments.report.empty()) {
    if (const Status written = write_text(arguments.report, to_json(*report), options.overwrite); !written) {
      return fail(written.error().message);
    }
  }
  const tick::Tally& tally = report->tally;
  if (tally.scans_in == 0 && tally.refused_inputs > 0)
    return fail(options.log + ": none of its scans could be used; see 'refused' above");
  return report->complete && !stop_asked() ? Exit::done : Exit::failed;
}

}  // namespace

void add_replay(CLI::App& app, Exit& exit) {
  CLI::App* command = app.add_subcommand("replay", "Run the server over a recorded log; deterministic");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("log", arguments->options.log, "LCM log with inputs, or a session log")->required();
  command->add_option("--scenario", arguments->scenario,
                      "Scenario with agents and limits; by default the session's own");
  command->add_option("--robot", arguments->robot, "Robot description; overrides the ROBOT channel");
  command->add_option("--texture", arguments->texture,
                      "Texture that simulated cameras show (map texture); session logs do not contain it");
  command->add_option("-o,--output", arguments->options.session, "Session log to write (inputs and outputs)");
  command->add_option("--report", arguments->report, "JSON report to write; - for standard output");
  command->add_option("--seed", arguments->seed, "Overrides the scenario's seed");
  command->add_option("--rate", arguments->options.rate, "Times real time; 0: as fast as possible")
      ->check(CLI::Range(0.0, 1e6));
  command->add_option("--threads", arguments->options.threads, "1: render between inputs; more: in parallel")
      ->check(CLI::Range(1, 64));
  command->add_flag("--publish", arguments->publish, "Publish the outputs on LCM; --url implies it");
  arguments->bus.add_to(*command);
  command->add_flag("--force", arguments->options.overwrite, "Overwrite files that exist");
  command->footer(
      "Example: parhelion replay localized.lcm --scenario lab.yaml -o session.lcm --report report.json\n\n"
      "The log needs POSE_COV, as `parhelion slam` writes it; without it scans go out unchanged.");
  command->callback([arguments, command, &exit] { exit = run(*arguments, *command); });
}

}  // namespace parhelion::tools
