#include "server/training/course_advice.hpp"

#include <algorithm>

#include "protocols/scenario.hpp"

namespace parhelion::training {

Result<std::vector<TaskOffer>> course_tasks(const Course& course) {
  std::vector<TaskOffer> offers;
  bool skilled = false;
  for (const CourseProgramme& programme : course.programmes) {
    const auto scenario = load_scenario(programme.scenario);
    if (!scenario) return scenario.error();
    if (!scenario->training)
      return Error{programme.scenario + ": has no 'training', which each programme of a course needs"};
    for (const Task& task : scenario->training->tasks) {
      offers.push_back({scenario->name, task.name, task.skills, scenario->level, 0});
      skilled = skilled || !task.skills.empty();
    }
  }
  if (!skilled)
    return Error{"course '" + course.name +
                 "': no task says which skills it trains; give some of them `skills: [...]`"};
  rank_difficulties(offers);
  return offers;
}

std::vector<Attempt> attempts_of(const std::vector<SessionRecord>& sessions,
                                 const std::vector<TaskOffer>& offers) {
  std::vector<Attempt> attempts;
  for (const SessionRecord& session : sessions) {
    for (const TaskGrade& task : session.grade.tasks) {
      if (!task.began || task.outcome == TaskOutcome::open) continue;
      const auto offer = std::find_if(offers.begin(), offers.end(), [&](const TaskOffer& one) {
        return one.scenario == session.scenario && one.name == task.name;
      });
      if (offer != offers.end())
        attempts.push_back(
            {static_cast<std::size_t>(offer - offers.begin()), task.outcome == TaskOutcome::done});
    }
  }
  return attempts;
}

Result<CourseAdvice> advise(Records& records, const std::string& pseudonym, const Course& course) {
  auto offers = course_tasks(course);
  if (!offers) return offers.error();
  const auto trainees = records.trainees();
  if (!trainees) return trainees.error();
  std::vector<std::vector<Attempt>> group;
  std::vector<Attempt> own;
  int level = 1;
  for (const TraineeRecord& trainee : *trainees) {
    const auto sessions = records.sessions(trainee.pseudonym);
    if (!sessions) return sessions.error();
    group.push_back(attempts_of(*sessions, *offers));
    if (trainee.pseudonym == pseudonym) own = group.back();
  }
  const SkillParameters parameters = fit_parameters(*offers, group);
  fit_difficulties(*offers, group, parameters);
  Skills skills(parameters);
  for (const Attempt& attempt : own) {
    const TaskOffer& offer = (*offers)[attempt.offer];
    skills.observe(offer.skills, offer.difficulty, attempt.done);
    level = offer.level;
  }
  CourseAdvice advice;
  advice.next = next_task(skills, *offers, level, parameters);
  advice.seen = own.size();
  if (advice.next.kind == NextTask::Kind::complete) return advice;
  advice.task = (*offers)[advice.next.offer];
  std::size_t at = advice.next.offer;
  for (const CourseProgramme& programme : course.programmes) {
    const auto scenario = load_scenario(programme.scenario);
    if (scenario && at < scenario->training->tasks.size()) {
      advice.programme = programme.scenario;
      break;
    }
    if (scenario) at -= scenario->training->tasks.size();
  }
  return advice;
}

}  // namespace parhelion::training
