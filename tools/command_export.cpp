// parhelion export: converts a session for other programs.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <map>

#include "tools/command.hpp"
#include "tools/command_line.hpp"
#include "tools/export/export_mcap.hpp"
#include "tools/progress.hpp"
#include "tools/stop_signal.hpp"

namespace parhelion::tools {
namespace {

Exit run(ExportOptions& options) {
  catch_stop_signals();
  Progress progress("export", "MB");
  options.progress = [&](std::uint64_t done, std::uint64_t total) {
    progress.update(static_cast<double>(done) / 1e6, static_cast<double>(total) / 1e6);
  };
  options.stop = stop_asked;
  const auto start = std::chrono::steady_clock::now();
  const auto report = export_mcap(options);
  progress.finish();
  if (!report) {
    std::fprintf(stderr, "parhelion export: %s\n", report.error().message.c_str());
    return Exit::failed;
  }
  const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  for (const auto& [topic, count] : report->messages)
    std::printf("%10llu  %s\n", static_cast<unsigned long long>(count), topic.c_str());
  std::printf("%s: %.1f MB of log, %.1f MB, %.1f s\n", options.output.c_str(),
              static_cast<double>(report->bytes_in) / 1e6, static_cast<double>(report->bytes_out) / 1e6,
              took);
  for (const std::string& omission : report->omissions)
    std::fprintf(stderr, "parhelion export: %s\n", omission.c_str());
  if (report->unreadable > 0) {
    std::fprintf(stderr,
                 "parhelion export: %llu messages cannot be decoded and are left out, the first: %s\n",
                 static_cast<unsigned long long>(report->unreadable), report->first_unreadable.c_str());
  }
  if (report->skipped_bytes > 0) {
    std::fprintf(stderr, "parhelion export: %llu bytes of %s are damaged; their content is missing\n",
                 static_cast<unsigned long long>(report->skipped_bytes), options.log.c_str());
  }
  return report->unreadable > 0 || report->skipped_bytes > 0 ? Exit::failed : Exit::done;
}

}  // namespace

void add_export(CLI::App& app, Exit& exit) {
  CLI::App* command = app.add_subcommand("export", "Export a session as MCAP, for Foxglove and Lichtblick");
  auto options = std::make_shared<ExportOptions>();
  command->add_option("log", options->log, "Session log; with --raw any LCM log")->required();
  command->add_option("--mcap", options->output, "MCAP file to write")->required();
  command->add_option("--compression", options->compression, "zstd (the default), lz4 or none")
      ->transform(one_of(std::map<std::string, McapCompression>{
          {"zstd", McapCompression::zstd}, {"lz4", McapCompression::lz4}, {"none", McapCompression::none}}))
      ->type_name("TEXT");
  command->add_flag("--raw", options->raw, "Also the unchanged LCM messages, on lcm/CHANNEL");
  command->add_flag("--force", options->overwrite, "Overwrite the file if it exists");
  command->footer(
      "Example:\n  parhelion export session.lcm --mcap session.mcap\n\n"
      "Scans, virtual returns, images, poses, transforms, the scene, events, score and commands become "
      "Foxglove's\n"
      "own messages (JSON); a reader needs nothing from Parhelion.");
  command->callback([options, &exit] { exit = run(*options); });
}

}  // namespace parhelion::tools
