// parhelion batch: the scores of many sessions.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <thread>

#include "server/runtime/grade_batch.hpp"
#include "tools/progress.hpp"
#include "tools/records_commands.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

struct Arguments {
  std::vector<std::string> places;
  unsigned threads = std::max(1U, std::thread::hardware_concurrency());
  std::string output = "-", shard = "1/1";
  std::uint64_t memory = 1024;  // MB
  bool force = false;
};

/// "i/n" with 1 <= i <= n.
bool read_shard(const std::string& text, std::size_t& shard, std::size_t& shards) {
  int used = 0;
  // sscanf takes a sign, and -1 for the greatest number.
  return text.find_first_not_of("0123456789/") == std::string::npos &&
         std::sscanf(text.c_str(), "%zu/%zu%n", &shard, &shards, &used) == 2 &&
         static_cast<std::size_t>(used) == text.size() && shard >= 1 && shard <= shards;
}

std::string check_shard(const std::string& text) {
  std::size_t shard = 0, shards = 0;
  return read_shard(text, shard, shards) ? "" : "'" + text + "'; expected as 2/8: the second part of eight";
}

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

Exit failed(const Error& error) {
  std::fprintf(stderr, "parhelion batch: %s\n", error.message.c_str());
  return Exit::failed;
}

Exit run(const Arguments& arguments) {
  if (const Status free = check_writable(arguments.output, arguments.force); !free)
    return failed(free.error());
  const auto all = runtime::session_logs(arguments.places);
  if (!all) return failed(all.error());
  std::size_t shard = 1, shards = 1;
  read_shard(arguments.shard, shard, shards);
  const auto logs = runtime::shard_of(*all, shard - 1, shards);
  Progress progress("batch", "sessions");
  runtime::GradeProcess process;
  process.bytes = arguments.memory << 20U;
  const auto rows = runtime::grade_batch(
      logs, arguments.threads,
      [&](std::size_t done, std::size_t of) {
        progress.update(static_cast<double>(done), static_cast<double>(of));
      },
      process);
  progress.finish();
  const Status written = write_text(
      arguments.output, ends_with(arguments.output, ".json") ? to_json(rows) : runtime::to_csv(rows),
      arguments.force);
  if (!written) return failed(written.error());
  std::size_t bad = 0, passed = 0;
  for (const runtime::BatchRow& row : rows) {
    passed += row.passed ? 1 : 0;
    if (row.error.empty()) continue;
    ++bad;
    std::fprintf(stderr, "parhelion batch: %s\n", row.error.c_str());
  }
  std::fprintf(stderr, "%zu %s graded, %zu passed, %zu could not be graded\n", rows.size() - bad,
               rows.size() - bad == 1 ? "session" : "sessions", passed, bad);
  return bad == 0 ? Exit::done : Exit::failed;
}

}  // namespace

void add_batch(CLI::App& app, Exit& exit) {
  CLI::App* command = app.add_subcommand("batch", "Score many sessions, one line each");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("places", arguments->places, "Session logs, and folders of them")->required();
  command->add_option("--threads", arguments->threads, "Parallel sessions; default: one for each processor")
      ->check(CLI::Range(1U, 1024U));
  command->add_option("-o,--output", arguments->output, "Table, .csv or .json; default: CSV on the terminal");
  command
      ->add_option("--shard", arguments->shard,
                   "Only one part of the logs, such as 2/8, to share them among machines")
      ->check(check_shard);
  command->add_option("--memory", arguments->memory, "For each session, MB")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 20U))
      ->capture_default_str();
  command->add_flag("--force", arguments->force, "Overwrite the table");
  command->footer(
      "Example: parhelion batch sessions/ -o results.csv\n\n"
      "In the order of their names. A log that cannot be graded is in the table with the reason, and the\n"
      "command then ends with 1. Each log is graded in a process of its own: one that crashes or needs more\n"
      "memory than --memory does not end the others.");
  command->callback([arguments, &exit] { exit = run(*arguments); });
}

}  // namespace parhelion::tools
