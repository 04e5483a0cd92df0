// parhelion records: the trainees and their results.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "server/runtime/session_record.hpp"
#include "server/training/course_advice.hpp"
#include "server/training/exchange.hpp"
#include "tools/progress.hpp"
#include "tools/records_commands.hpp"
#include "tools/records_file.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

struct Arguments {
  std::string database, trainee, file, mbox_sha1sum, format, output, course;
  std::vector<std::string> logs;
  std::string home_page = "https://parhelion.invalid";
  bool json = false, names = false, again = false, force = false, yes = false;
};

Result<std::string> text_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{path + ": cannot be read; is the name correct?"};
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (file.bad()) return Error{path + ": cannot be read to its end"};
  return text;
}

Status add(const Arguments& arguments) {
  auto records = open_records(arguments.database, true);
  if (!records) return records.error();
  const auto added = records->add({"", arguments.trainee, arguments.mbox_sha1sum});
  if (!added) return added.error();
  std::printf("%s\n", added->pseudonym.c_str());
  return {};
}

Status grade(const Arguments& arguments) {
  auto records = open_records(arguments.database, false);
  if (!records) return records.error();
  const auto trainee = records->find(arguments.trainee);
  if (!trainee) return trainee.error();
  Status status;
  for (const std::string& log : arguments.logs) {
    Progress progress("records grade", "MB");
    const auto session = runtime::session_record(log, [&](std::uint64_t done, std::uint64_t all) {
      progress.update(static_cast<double>(done) / 1e6, static_cast<double>(all) / 1e6);
    });
    progress.finish();
    if (!session) return session.error();
    const auto stored = records->store(trainee->pseudonym, *session, arguments.again);
    if (!stored) return Error{log + ": " + stored.error().message};
    const char* what = *stored == training::Records::Stored::added ? "stored"
                       : *stored == training::Records::Stored::replaced
                           ? "graded again"
                           : "is stored already, unchanged (--again)";
    std::printf("%s  %s: %.2f of %.2f points, %s%s; %s\n", trainee->pseudonym.c_str(),
                session->scenario.c_str(), session->grade.score, session->grade.max,
                session->grade.passed ? "passed" : "not passed",
                session->grade.complete ? "" : " (INCOMPLETE)", what);
    std::fflush(stdout);
  }
  return status;
}

Result<std::vector<training::TraineeHistory>> histories_of(training::Records& records,
                                                           const Arguments& arguments) {
  std::vector<training::TraineeRecord> chosen;
  if (!arguments.trainee.empty()) {
    const auto trainee = records.find(arguments.trainee);
    if (!trainee) return trainee.error();
    chosen = {*trainee};
  } else {
    auto all = records.trainees();
    if (!all) return all.error();
    chosen = std::move(*all);
  }
  std::vector<training::TraineeHistory> histories;
  for (training::TraineeRecord& trainee : chosen) {
    auto sessions = records.sessions(trainee.pseudonym);
    if (!sessions) return sessions.error();
    histories.push_back({std::move(trainee), std::move(*sessions)});
  }
  return histories;
}

void print_sessions(const training::TraineeHistory& history) {
  std::printf("%s  %s\n", history.trainee.pseudonym.c_str(), history.trainee.name.c_str());
  for (const training::SessionRecord& session : history.sessions)
    std::printf("  %8.2f of %8.2f  %5.1f %%  %-4s %-10s %7.1f s  %s%s%s\n", session.grade.score,
                session.grade.max, 100 * session.grade.fraction, session.grade.grade.c_str(),
                session.grade.passed ? "passed" : "not passed",
                (session.grade.end - session.grade.begin).seconds(), session.scenario.c_str(),
                session.grade.complete ? "" : " (INCOMPLETE)",
                session.log.empty() ? "" : ("  " + session.log).c_str());
}

void print_trainees(const std::vector<training::TraineeHistory>& histories) {
  for (const training::TraineeHistory& history : histories) {
    std::size_t passed = 0;
    for (const training::SessionRecord& session : history.sessions) passed += session.grade.passed ? 1 : 0;
    std::printf("%-16s %4zu sessions, %4zu passed  %s\n", history.trainee.pseudonym.c_str(),
                history.sessions.size(), passed, history.trainee.name.c_str());
  }
}

Status list(const Arguments& arguments) {
  auto records = open_records(arguments.database, false);
  if (!records) return records.error();
  const auto histories = histories_of(*records, arguments);
  if (!histories) return histories.error();
  if (arguments.json) {
    std::fputs(to_json(*histories).c_str(), stdout);
  } else if (arguments.trainee.empty()) {
    print_trainees(*histories);
  } else {
    print_sessions(histories->front());
  }
  return {};
}

/// File names may contain persons' names.
void leave_out_names(std::vector<training::TraineeHistory>& histories) {
  for (training::TraineeHistory& history : histories) {
    history.trainee.name = history.trainee.mbox_sha1sum = "";
    for (training::SessionRecord& session : history.sessions) session.log.clear();
  }
}

Status export_to(const Arguments& arguments) {
  if (const Status free = check_writable(arguments.output, arguments.force); !free) return free;
  auto records = open_records(arguments.database, false);
  if (!records) return records.error();
  auto histories = histories_of(*records, arguments);
  if (!histories) return histories.error();
  if (!arguments.names) leave_out_names(*histories);
  const std::string text = arguments.format == "csv"    ? training::to_csv(*histories)
                           : arguments.format == "xapi" ? training::to_xapi(*histories, arguments.home_page)
                                                        : to_json(*histories);
  return write_text(arguments.output, text, arguments.force, arguments.names ? Readers::owner : Readers::all);
}

Status import_from(const Arguments& arguments) {
  const auto text = text_of(arguments.file);
  if (!text) return text.error();
  const auto histories = training::histories_from(*text, arguments.file);
  if (!histories) return histories.error();
  auto records = open_records(arguments.database, true);
  if (!records) return records.error();
  const auto taken = training::take(*records, *histories);
  if (!taken) return Error{arguments.file + ": " + taken.error().message + "; nothing was imported"};
  const auto counted = [](std::size_t count, const std::string& what) {
    return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
  };
  std::printf("new: %s, %s; already there: %s\n", counted(taken->trainees, "trainee").c_str(),
              counted(taken->sessions, "session").c_str(), counted(taken->present, "session").c_str());
  if (histories->skipped > 0)
    std::printf("%zu statements have no result and were left out\n", histories->skipped);
  return {};
}

Status next(const Arguments& arguments) {
  const auto course = load_course(arguments.course);
  if (!course) return course.error();
  auto records = open_records(arguments.database, false);
  if (!records) return records.error();
  const auto trainee = records->find(arguments.trainee);
  if (!trainee) return trainee.error();
  const auto advice = training::advise(*records, trainee->pseudonym, *course);
  if (!advice) return advice.error();
  if (arguments.json) {
    static constexpr const char* kKinds[] = {"task", "step_back", "complete"};
    nlohmann::ordered_json json{{"trainee", trainee->pseudonym},
                                {"kind", kKinds[static_cast<int>(advice->next.kind)]},
                                {"confidence", advice->next.confidence},
                                {"reason", advice->next.reason},
                                {"tasks_seen", advice->seen}};
    if (advice->next.kind != training::NextTask::Kind::complete) {
      json["programme"] = advice->programme;
      json["task"] = advice->task.name;
      json["skills"] = advice->task.skills;
      json["chance"] = advice->next.chance;
    }
    // A folder's name may be invalid UTF-8.
    std::printf("%s\n", json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
    return {};
  }
  std::printf("%s\n", advice->next.reason.c_str());
  if (!advice->programme.empty()) std::printf("parhelion serve %s\n", advice->programme.c_str());
  return {};
}

Status erase(const Arguments& arguments) {
  auto records = open_records(arguments.database, false);
  if (!records) return records.error();
  const auto trainee = records->find(arguments.trainee);
  if (!trainee) return trainee.error();
  if (!arguments.yes)
    return Error{"this erases " + trainee->pseudonym + " and every session permanently; confirm with --yes"};
  if (const Status erased = records->erase(trainee->pseudonym); !erased) return erased;
  std::printf("%s is erased; session logs and earlier exports are separate files\n",
              trainee->pseudonym.c_str());
  return {};
}

/// A sub-subcommand whose options the caller adds.
CLI::App* add_part(CLI::App& command, Exit& exit, const std::shared_ptr<Arguments>& arguments,
                   const char* name, const char* text, const char* example, Status (*run)(const Arguments&)) {
  CLI::App* part = command.add_subcommand(name, text);
  part->add_option("--database", arguments->database, kRecordsHelp);
  part->footer(std::string("Example: parhelion records ") + example);
  const std::string label = std::string("parhelion records ") + name;
  part->callback([arguments, run, label, &exit] {
    const Status done = run(*arguments);
    if (!done) std::fprintf(stderr, "%s: %s\n", label.c_str(), done.error().message.c_str());
    exit = done ? Exit::done : Exit::failed;
  });
  return part;
}

void add_keeping(CLI::App& command, Exit& exit, const std::shared_ptr<Arguments>& arguments) {
  CLI::App* part = add_part(command, exit, arguments, "add", "Add a trainee; prints the pseudonym",
                            "add \"Anna Schmidt\"", add);
  part->add_option("name", arguments->trainee, "Name of the person; only stored in the records")->required();
  part->add_option("--mbox-sha1sum", arguments->mbox_sha1sum,
                   "SHA-1 of mailto:ADDRESS, the xAPI identifier of a person");
  part = add_part(command, exit, arguments, "grade", "Grade sessions of a trainee and store them",
                  "grade \"Anna Schmidt\" session.lcm", grade);
  part->add_option("trainee", arguments->trainee, "Name or pseudonym")->required();
  part->add_option("logs", arguments->logs, "Session logs, as serve and replay -o write them")->required();
  part->add_flag("--again", arguments->again, "Replace the grade of a stored session");
  part =
      add_part(command, exit, arguments, "list", "List the trainees, or the sessions of one", "list", list);
  part->add_option("trainee", arguments->trainee, "Name or pseudonym; without: all");
  part->add_flag("--json", arguments->json, "JSON output with everything, names included");
  part = add_part(command, exit, arguments, "next", "Choose the next task for a trainee, with the reason",
                  "next \"Anna Schmidt\" --course server/scenarios/programmes/course.yaml", next);
  part->add_option("trainee", arguments->trainee, "Name or pseudonym")->required();
  part->add_option("--course", arguments->course, "Programmes whose tasks list the skills that they train")
      ->required();
  part->add_flag("--json", arguments->json, "JSON output");
  part = add_part(command, exit, arguments, "erase", "Erase all data of a trainee",
                  "erase \"Anna Schmidt\" --yes", erase);
  part->add_option("trainee", arguments->trainee, "Name or pseudonym")->required();
  part->add_flag("--yes", arguments->yes, "Confirm");
}

std::string check_home_page(const std::string& text) {
  return text.find("://") != std::string::npos ? "" : "'" + text + "'; expected as https://school.example";
}

void add_exchange(CLI::App& command, Exit& exit, const std::shared_ptr<Arguments>& arguments) {
  CLI::App* part =
      add_part(command, exit, arguments, "export", "Export records as JSON, CSV or xAPI statements",
               "export --format xapi -o statements.json", export_to);
  part->add_option("trainee", arguments->trainee, "Name or pseudonym; without: all");
  part->add_option("--format", arguments->format,
                   "json (everything), csv or xapi (a line or statement a session)")
      ->check(CLI::IsMember({"json", "csv", "xapi"}))
      ->default_str("json");
  part->add_option("-o,--output", arguments->output, "File; - is the terminal")->required();
  part->add_flag(
      "--names", arguments->names,
      "With names, mail hashes and names of log files, readable by you alone; else only pseudonyms");
  part->add_option("--home-page", arguments->home_page, "xAPI: home page of the pseudonymous accounts")
      ->check(check_home_page)
      ->capture_default_str();
  part->add_flag("--force", arguments->force, "Overwrite the file");
  part = add_part(command, exit, arguments, "import", "Import the output of export or of another xAPI system",
                  "import statements.json", import_from);
  part->add_option("file", arguments->file, "JSON, CSV or xAPI; all of it or, on an error, nothing")
      ->required();
}

}  // namespace

void add_records(CLI::App& app, Exit& exit) {
  CLI::App* command =
      app.add_subcommand("records", "Keep the records of trainees: their sessions and scores");
  command->require_subcommand(1);
  command->footer(
      "Example: parhelion records add \"Anna Schmidt\" && parhelion records grade \"Anna Schmidt\" "
      "session.lcm\n\n"
      "Names stay in the records: sessions, exports and messages of erase go by a pseudonym.");
  auto arguments = std::make_shared<Arguments>();
  add_keeping(*command, exit, arguments);
  add_exchange(*command, exit, arguments);
  add_ranking(*command, exit);
}

}  // namespace parhelion::tools
