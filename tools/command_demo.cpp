// parhelion demo: the whole pipeline on a real recording, without a robot.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "server/station/base_station.hpp"
#include "tools/command.hpp"
#include "tools/demo/demo.hpp"
#include "tools/progress.hpp"
#include "tools/stop_signal.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

struct Arguments {
  DemoOptions options;
  std::string report, url, engine = "parhelion";
  std::string http = "127.0.0.1:0";
  bool headless = false, silent = false;
};

Exit fail(const std::string& what) {
  std::fprintf(stderr, "parhelion demo: %s\n", what.c_str());
  return Exit::failed;
}

Exit run(Arguments& arguments) {
  catch_stop_signals();
  DemoOptions& options = arguments.options;
  // Pages show the session in real time.
  if (!arguments.headless && !options.fast) options.http = arguments.http;
  if (!options.http.empty()) {
    if (const auto at = station::parse_host_port(options.http); !at)
      return fail("--http: " + at.error().message);
  }
  if (!options.overwrite && std::filesystem::exists(std::filesystem::path(options.folder) / "recording.lcm"))
    return fail(options.folder +
                " contains an earlier demo; --force overwrites it, --folder NAME uses another folder");
  for (const std::string& path : {options.session, arguments.report}) {
    if (const Status writable = check_writable(path, options.overwrite); !writable)
      return fail(writable.error().message);
  }
  std::unique_ptr<Bus> bus;
  if (!arguments.silent) {
    auto opened = open_network_bus(arguments.url);
    if (opened) {
      bus = std::move(*opened);
      options.bus = bus.get();
    } else {
      std::fprintf(stderr, "parhelion demo: not publishing on LCM: %s\n", opened.error().message.c_str());
    }
  }
  std::optional<Progress> progress;
  std::string task;
  options.progress = [&](const std::string& now, double done, double total) {
    if (now != task) {
      if (progress) progress->finish();
      progress.emplace(now, now == "replay" ? "MB" : "");
      task = now;
    }
    progress->update(done, total);
  };
  options.notify = [&](const std::string& line) {
    if (progress) progress->finish();
    progress.reset();
    task.clear();
    std::printf("%s\n", line.c_str());
    std::fflush(stdout);
  };
  options.stop = stop_asked;
  options.engine = pose::slam_engine(arguments.engine).value_or(options.engine);
  const auto result = run_demo(options);
  if (progress) progress->finish();
  if (!result) return fail(result.error().message);
  std::printf("\n%s\nsession  %s\nmap      %s\n", runtime::summary(result->report).c_str(),
              result->session.c_str(), result->map_picture.c_str());
  const std::string& picture = result->camera_picture;
  std::printf("camera   %s%s%s%s\n", picture.c_str(), picture.empty() ? "" : " (", result->camera.c_str(),
              picture.empty() ? "" : ")");
  std::printf("next     parhelion report %s -o report.html\n", result->session.c_str());
  if (!arguments.report.empty()) {
    const Status written = write_text(arguments.report, to_json(result->report), options.overwrite);
    if (!written) return fail(written.error().message);
  }
  return result->report.complete ? Exit::done : Exit::failed;
}

}  // namespace

void add_demo(CLI::App& app, Exit& exit) {
  CLI::App* command = app.add_subcommand(
      "demo", "Map a recorded building, put three virtual robots into it, and drive the real robot through");
  auto arguments = std::make_shared<Arguments>();
  DemoOptions& options = arguments->options;
  command->add_flag("--headless", arguments->headless, "Without the page: ends with the recording");
  command->add_flag("--fast", options.fast, "Headless, as fast as possible instead of in real time");
  command->add_option("--http", arguments->http, "ADDR:PORT of the page; port 0: any that is free")
      ->capture_default_str();
  command->add_option(
      "--foxglove", options.foxglove,
      "ADDR:PORT (usually 8765) of a server for Foxglove and Lichtblick; further pages that may read it: "
      "ADDR:PORT,ORIGIN,...");
  command->add_option("-o,--output", options.session, "Session log; by default session.lcm in the folder");
  command->add_option("--report", arguments->report, "JSON report to write; - for standard output");
  command->add_option("--folder", options.folder, "Folder for logs, map, model, scenario and pictures");
  command->add_option("--recording", options.recording,
                      "An MRPT rawlog or another recording with scans and odometry");
  command->add_option("--engine", arguments->engine, "Engine of SLAM: Parhelion's own or one of MRPT's")
      ->check(CLI::IsMember(pose::slam_engines()))
      ->capture_default_str();
  command->add_option("--url", arguments->url, "LCM URL to publish on");
  command->add_flag("--silent", arguments->silent, "Do not publish on LCM");
  command->add_flag("--force", options.overwrite, "Overwrite the files of an earlier demo");
  command->footer(
      "Example:\n  parhelion demo\n  parhelion demo --headless --fast -o session.lcm --report report.json\n\n"
      "Prints links: whoever opens the first on this machine is the instructor, who ends it (or ^C does);\n"
      "the others are for a trainee, who drives a virtual robot and is graded, and for an observer. A "
      "browser\n"
      "can use only one of the links at a time: open the others in another browser or a private window.");
  command->callback([arguments, &exit] { exit = run(*arguments); });
}

}  // namespace parhelion::tools
