// parhelion records ranking: the ranking of a course or of one programme.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "server/training/ranking.hpp"
#include "tools/records_commands.hpp"
#include "tools/records_file.hpp"

namespace parhelion::tools {
namespace {

using Json = nlohmann::ordered_json;

struct Arguments {
  std::string database, course, scenario;
  bool json = false, names = false;
};

void print(const Json& json) {
  std::printf("%s\n", json.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
}

std::string name_of(const training::TraineeRecord& trainee, const Arguments& arguments) {
  return arguments.names ? trainee.name : "";
}

Status rank_programme(training::Records& records, const Arguments& arguments) {
  const auto places = training::programme_ranking(records, arguments.scenario);
  if (!places) return places.error();
  if (places->empty())
    return Error{"no session of scenario '" + arguments.scenario +
                 "' is in the records; `parhelion records list TRAINEE` lists them"};
  Json json = Json::array();
  for (std::size_t i = 0; i < places->size(); ++i) {
    const auto& [trainee, best, sessions] = (*places)[i];
    const double lasted = (best.grade.end - best.grade.begin).seconds();
    json.push_back({{"place", i + 1},
                    {"trainee", trainee.pseudonym},
                    {"score", best.grade.score},
                    {"max", best.grade.max},
                    {"fraction", best.grade.fraction},
                    {"grade", best.grade.grade},
                    {"passed", best.grade.passed},
                    {"seconds", lasted},
                    {"sessions", sessions}});
    if (arguments.names) json.back()["name"] = trainee.name;
    if (arguments.json) continue;
    std::printf("%3zu. %-16s %5.1f %%  %-12s %-10s %7.1f s  best of %zu  %s\n", i + 1,
                trainee.pseudonym.c_str(), 100 * best.grade.fraction, best.grade.grade.c_str(),
                best.grade.passed ? "passed" : "not passed", lasted, sessions,
                name_of(trainee, arguments).c_str());
  }
  if (arguments.json) print(json);
  return {};
}

Json best_json(const Course& course, const training::CoursePlace& place) {
  Json best = Json::array();
  for (std::size_t i = 0; i < place.best.size(); ++i) {
    if (!place.best[i]) continue;
    best.push_back({{"programme", course.programmes[i].scenario},
                    {"fraction", place.best[i]->fraction},
                    {"passed", place.best[i]->passed}});
  }
  return best;
}

Status rank_course(training::Records& records, const Arguments& arguments) {
  const auto course = load_course(arguments.course);
  if (!course) return course.error();
  const auto places = training::course_ranking(records, *course);
  if (!places) return places.error();
  Json json = Json::array();
  for (std::size_t i = 0; i < places->size(); ++i) {
    const training::CoursePlace& place = (*places)[i];
    const CourseStanding& standing = place.standing;
    const std::string next = standing.next ? course->programmes[*standing.next].scenario : "";
    json.push_back({{"place", i + 1},
                    {"trainee", place.trainee.pseudonym},
                    {"rank", standing.rank},
                    {"passed", standing.passed},
                    {"fraction", standing.fraction},
                    {"next", next},
                    {"best", best_json(*course, place)}});
    if (arguments.names) json.back()["name"] = place.trainee.name;
    if (arguments.json) continue;
    std::printf("%3zu. %-16s %-12s %2zu of %zu passed  %5.1f %%  %s\n", i + 1,
                place.trainee.pseudonym.c_str(), standing.rank.empty() ? "-" : standing.rank.c_str(),
                standing.passed, course->programmes.size(), 100 * standing.fraction,
                name_of(place.trainee, arguments).c_str());
  }
  if (arguments.json) print(json);
  return {};
}

Status rank(const Arguments& arguments) {
  auto records = open_records(arguments.database, false);
  if (!records) return records.error();
  return arguments.course.empty() ? rank_programme(*records, arguments) : rank_course(*records, arguments);
}

}  // namespace

void add_ranking(CLI::App& records, Exit& exit) {
  CLI::App* command = records.add_subcommand("ranking", "Show the ranking in a course or in one programme");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("--database", arguments->database, kRecordsHelp);
  auto* which = command->add_option_group("which")->require_option(1);
  which->add_option("--course", arguments->course,
                    "By programmes passed, then by points, with the course's ranks");
  which->add_option("--scenario", arguments->scenario, "By the best session of the scenario of this name");
  command->add_flag("--names", arguments->names, "With names; else only pseudonyms");
  command->add_flag("--json", arguments->json, "JSON output");
  command->footer("Example: parhelion records ranking --course server/scenarios/programmes/course.yaml");
  command->callback([arguments, &exit] {
    const Status done = rank(*arguments);
    if (!done) std::fprintf(stderr, "parhelion records ranking: %s\n", done.error().message.c_str());
    exit = done ? Exit::done : Exit::failed;
  });
}

}  // namespace parhelion::tools
