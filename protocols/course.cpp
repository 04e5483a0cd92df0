#include "protocols/course.hpp"

#include <algorithm>
#include <filesystem>
#include <map>

#include "protocols/yaml/parts.hpp"
#include "protocols/yaml/schema.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion {
namespace {

using yaml::Node;
using yaml::Problems;

void read_programmes(const Node& list, Course& course, Problems& problems) {
  std::map<std::string, int> lines;
  for (const Node& item : list.items) {
    CourseProgramme& programme = course.programmes.emplace_back();
    read(item, "scenario", programme.scenario);
    read(item, "text", programme.text);
    const auto [known, inserted] = lines.emplace(programme.scenario, item.line);
    if (!inserted)
      problems.add(item.line, "scenario '" + yaml::printable(programme.scenario) +
                                  "' is a duplicate of line " + std::to_string(known->second));
  }
}

void read_ranking(const Node& list, Course& course, Problems& problems) {
  for (const Node& item : list.items) {
    CourseRank rank;
    read(item, "name", rank.name);
    read(item, "passed", rank.passed);
    read(item, "from", rank.from);
    const std::string what = "rank '" + yaml::printable(rank.name) + "'";
    if (rank.passed > course.programmes.size())
      problems.add(item.line, what + ": cannot require " + std::to_string(rank.passed) +
                                  " passed programmes, the course has " +
                                  std::to_string(course.programmes.size()));
    if (!course.ranking.empty()) {
      const CourseRank& above = course.ranking.back();
      if (rank.passed > above.passed || rank.from > above.from ||
          (rank.passed == above.passed && rank.from == above.from))
        problems.add(item.line, what + ": expected the highest first, each easier than the one before");
    }
    course.ranking.push_back(std::move(rank));
  }
}

}  // namespace

Result<Course> parse_course(const std::string& yaml, const std::string& origin) {
  const auto document = yaml::read_checked(yaml, origin, "course");
  if (!document) return document.error();
  Problems problems(origin);
  Course course;
  read(*document, "course", course.name);
  read(*document, "text", course.text);
  read_programmes(*document->find("programmes"), course, problems);
  if (const Node* ranking = document->find("ranking")) read_ranking(*ranking, course, problems);
  if (!problems.empty()) return problems.error();
  return course;
}

Result<Course> load_course(const std::string& path) {
  const auto text = yaml::read_text(path);
  if (!text) return text.error();
  auto course = parse_course(*text, path);
  if (!course) return course;
  const auto folder = std::filesystem::path(path).parent_path();
  for (CourseProgramme& programme : course->programmes)
    programme.scenario = (folder / programme.scenario).lexically_normal().string();
  return course;
}

CourseStanding standing_in(const Course& course, const std::vector<std::optional<ProgrammeResult>>& best) {
  CourseStanding standing;
  for (std::size_t i = 0; i < course.programmes.size(); ++i) {
    const ProgrammeResult result = i < best.size() && best[i] ? *best[i] : ProgrammeResult{};
    standing.fraction += result.fraction;
    standing.passed += result.passed;
    if (!result.passed && !standing.next) standing.next = i;
  }
  if (!course.programmes.empty()) standing.fraction /= static_cast<double>(course.programmes.size());
  const auto rank = std::find_if(course.ranking.begin(), course.ranking.end(), [&](const CourseRank& each) {
    return standing.passed >= each.passed && standing.fraction >= each.from;
  });
  if (rank != course.ranking.end()) standing.rank = rank->name;
  return standing;
}

}  // namespace parhelion
