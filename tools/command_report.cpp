// parhelion report: the after-action page of a session.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "server/review/page.hpp"
#include "server/runtime/session_record.hpp"
#include "server/training/ranking.hpp"
#include "tools/command.hpp"
#include "tools/progress.hpp"
#include "tools/records_file.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

struct Arguments {
  std::string log, robot, against, output = "report.html", trainee, database;
  std::vector<std::string> earlier, group;
  bool overwrite = false;
};

Exit fail(const std::string& what) {
  std::fprintf(stderr, "parhelion report: %s\n", what.c_str());
  return Exit::failed;
}

Status add_session(const std::string& path, const std::string& robot, review::ReviewPage& page) {
  Progress progress(path, "MB");
  const auto show = [&](std::uint64_t done, std::uint64_t all) {
    progress.update(static_cast<double>(done) / 1e6, static_cast<double>(all) / 1e6);
  };
  auto review = review::review_session(path, {}, show, review::Reader::instructor, robot);
  progress.finish();
  if (!review) return review.error();
  page.sessions.push_back(std::move(*review));
  return {};
}

Status add_scores(const std::vector<std::string>& paths, std::vector<review::SessionScore>& scores) {
  for (const std::string& path : paths) {
    auto session = runtime::grade_session(path);
    if (!session) return session.error();
    scores.push_back(
        {std::filesystem::path(path).filename().string(), session->scenario, std::move(session->grade)});
  }
  std::stable_sort(scores.begin(), scores.end(),
                   [](const review::SessionScore& a, const review::SessionScore& b) {
                     return a.grade.begin < b.grade.begin;
                   });
  return {};
}

/// The trainee's earlier sessions of this scenario and others' best ones, from the records. Of others the
/// page shows only pseudonyms, not even file names, which may contain a person's name.
Status add_recorded(const Arguments& arguments, review::ReviewPage& page) {
  auto records = open_records(arguments.database, false);
  if (!records) return records.error();
  const auto trainee = records->find(arguments.trainee);
  if (!trainee) return trainee.error();
  const auto identity = runtime::session_identity(arguments.log);
  if (!identity) return identity.error();
  const std::string& scenario = page.sessions.front().scenario.name;
  auto own = records->sessions(trainee->pseudonym);
  if (!own) return own.error();
  for (training::SessionRecord& session : *own) {
    if (session.identity == *identity) break;  // sessions stored later are not earlier ones
    if (session.scenario == scenario)
      page.earlier.push_back({session.log, scenario, std::move(session.grade)});
  }
  auto group = training::programme_ranking(*records, scenario);
  if (!group) return group.error();
  for (training::ProgrammePlace& place : *group) {
    if (place.trainee.pseudonym == trainee->pseudonym) continue;
    page.group.push_back({place.trainee.pseudonym, scenario, std::move(place.best.grade)});
  }
  return {};
}

Exit run(const Arguments& arguments) {
  if (const Status writable = check_writable(arguments.output, arguments.overwrite); !writable)
    return fail(writable.error().message);
  review::ReviewPage page;
  for (const std::string& log : {arguments.log, arguments.against}) {
    if (log.empty()) continue;
    if (const Status added = add_session(log, arguments.robot, page); !added)
      return fail(added.error().message);
  }
  for (const auto& [paths, scores] :
       {std::pair{&arguments.earlier, &page.earlier}, std::pair{&arguments.group, &page.group}}) {
    if (const Status added = add_scores(*paths, *scores); !added) return fail(added.error().message);
  }
  if (!arguments.trainee.empty()) {
    if (const Status added = add_recorded(arguments, page); !added) return fail(added.error().message);
  }
  const std::string html = review::to_html(page);
  if (const Status written = write_text(arguments.output, html, arguments.overwrite); !written)
    return fail(written.error().message);
  if (arguments.output != "-")
    std::fprintf(stderr, "%s: %.1f MB, opens in any browser\n", arguments.output.c_str(),
                 static_cast<double>(html.size()) / 1e6);
  return Exit::done;
}

}  // namespace

void add_report(CLI::App& app, Exit& exit) {
  CLI::App* command =
      app.add_subcommand("report", "Write the after-action review of a session: one page for a browser");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("log", arguments->log, "Session log, as serve and replay -o write it")->required();
  command->add_option("-o,--output", arguments->output, "Page to write; - for standard output");
  command->add_option("--robot", arguments->robot,
                      "Robot whose session is reported, if several robots had trainees");
  command->add_option("--against", arguments->against,
                      "A second session to compare with, such as the same log with other agents");
  command->add_option("--earlier", arguments->earlier, "The trainee's earlier sessions");
  command->add_option("--group", arguments->group, "Sessions of other trainees, to compare with");
  auto* trainee =
      command->add_option("--trainee", arguments->trainee,
                          "Trainee in the records: compare with their sessions and those of others");
  command->add_option("--database", arguments->database, kRecordsHelp)->needs(trainee);
  command->add_flag("--force", arguments->overwrite, "Overwrite a file that exists");
  command->footer(
      "Example: parhelion report session.lcm -o report.html --earlier monday.lcm tuesday.lcm\n"
      "         parhelion report session.lcm -o report.html --trainee \"Anna Schmidt\"\n"
      "What if: parhelion replay session.lcm --scenario other.yaml -o other.lcm\n"
      "         parhelion report session.lcm --against other.lcm -o both.html\n\n"
      "The page is one file and needs no network; it can also be printed.\n"
      "A session whose scenario has no training section is shown without a score.");
  command->callback([arguments, &exit] { exit = run(*arguments); });
}

}  // namespace parhelion::tools
