#include "server/training/ranking.hpp"

#include <algorithm>
#include <tuple>

#include "protocols/scenario.hpp"

namespace parhelion::training {
namespace {

/// Larger is better.
auto worth(const Grade& grade) {
  return std::tuple(grade.passed, grade.fraction, -(grade.end - grade.begin).seconds());
}

}  // namespace

Result<std::vector<ProgrammePlace>> programme_ranking(Records& records, const std::string& scenario) {
  const auto trainees = records.trainees();
  if (!trainees) return trainees.error();
  std::vector<ProgrammePlace> places;
  for (const TraineeRecord& trainee : *trainees) {
    auto sessions = records.sessions(trainee.pseudonym);
    if (!sessions) return sessions.error();
    std::erase_if(*sessions, [&](const SessionRecord& each) { return each.scenario != scenario; });
    const auto best = std::max_element(sessions->begin(), sessions->end(), [](const auto& a, const auto& b) {
      return worth(a.grade) < worth(b.grade);
    });
    if (best != sessions->end()) places.push_back({trainee, std::move(*best), sessions->size()});
  }
  std::stable_sort(places.begin(), places.end(), [](const ProgrammePlace& a, const ProgrammePlace& b) {
    return worth(a.best.grade) > worth(b.best.grade);
  });
  return places;
}

Result<std::vector<CoursePlace>> course_ranking(Records& records, const Course& course) {
  const auto trainees = records.trainees();
  if (!trainees) return trainees.error();
  std::vector<CoursePlace> places;
  for (const TraineeRecord& trainee : *trainees) {
    places.push_back({trainee, {}, {}});
    places.back().best.resize(course.programmes.size());
  }
  for (std::size_t i = 0; i < course.programmes.size(); ++i) {
    const auto scenario = load_scenario(course.programmes[i].scenario);
    if (!scenario) return scenario.error();
    const auto ranked = programme_ranking(records, scenario->name);
    if (!ranked) return ranked.error();
    for (const ProgrammePlace& one : *ranked) {
      const auto place = std::find_if(places.begin(), places.end(), [&](const CoursePlace& each) {
        return each.trainee.pseudonym == one.trainee.pseudonym;
      });
      // A trainee just added by another program appears in the next ranking.
      if (place != places.end())
        place->best[i] = ProgrammeResult{one.best.grade.fraction, one.best.grade.passed};
    }
  }
  for (CoursePlace& place : places) place.standing = standing_in(course, place.best);
  std::stable_sort(places.begin(), places.end(), [](const CoursePlace& a, const CoursePlace& b) {
    return std::tuple(a.standing.passed, a.standing.fraction) >
           std::tuple(b.standing.passed, b.standing.fraction);
  });
  return places;
}

}  // namespace parhelion::training
