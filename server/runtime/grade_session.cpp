#include "server/runtime/grade_session.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "server/tick/check_training.hpp"
#include "server/tick/grading_path.hpp"
#include "server/training/grade_json.hpp"
#include "server/training/grading_text.hpp"

namespace parhelion::runtime {
namespace {

std::string at_text(SimulationTime at, SimulationTime begin) {
  char text[32];
  std::snprintf(text, sizeof text, "%8.2f s", (at - begin).seconds());
  return text;
}

}  // namespace

/// Passes the log's messages to a grader, which is created at the session's header.
class SessionGrading::Reading {
 public:
  explicit Reading(std::string path) : path_(std::move(path)) {}

  Status take(const Message& message) {
    if (message.channel == channel::kMrSession) return begin(message);
    if (graders_.empty()) return {};
    const tick::ChannelMap& channels = configuration_->channels;
    if (message.channel == channels.bus(channel::kMrEvents)) {
      Event event;
      if (const Status read = decode(message.channel, message.payload, event); !read) return read;
      for (training::Grader& grader : graders_) grader.take(event);
    } else if (message.channel == channels.bus(channel::kMrWorld)) {
      if (const Status read = decode(message.channel, message.payload, world_); !read) return read;
      for (training::Grader& grader : graders_) grader.take(world_);
    } else if (message.channel == channel::kLoop) {
      LoopDecision decision;
      if (const Status read = decode(message.channel, message.payload, decision); !read) return read;
      if (decision.kind != LoopDecision::Kind::ended) return {};
      for (training::Grader& grader : graders_) grader.close(simulation_time(message.arrival));
    }
    return {};
  }

  const tick::Configuration* configuration() const { return configuration_ ? &*configuration_ : nullptr; }
  const training::Grader* grader(const std::string& robot) const {
    if (graders_.empty()) return nullptr;
    const std::vector<std::string> robots = tick::graded_robots(*configuration_);
    const auto found = std::find(robots.begin(), robots.end(), robot);
    return found == robots.end() ? nullptr : &graders_[static_cast<std::size_t>(found - robots.begin())];
  }
  Result<std::vector<GradedSession>> results(std::uint64_t skipped_bytes) const {
    if (graders_.empty())
      return Error{path_ + ": no MR_SESSION in it; expected a session log, as serve and replay -o write it"};
    std::vector<GradedSession> all;
    const std::vector<std::string> robots = tick::graded_robots(*configuration_);
    for (std::size_t i = 0; i < robots.size(); ++i)
      all.push_back({path_, configuration_->scenario.name, robots[i], graders_[i].grade(), skipped_bytes});
    return all;
  }

 private:
  Status begin(const Message& message) {
    if (!graders_.empty()) return Error{path_ + ": a second MR_SESSION; expected the log of one session"};
    SessionHeader header;
    if (const Status read = decode(message.channel, message.payload, header); !read) return read;
    auto configuration = tick::configuration_from(header, path_);
    if (!configuration) return configuration.error();
    configuration_ = std::move(*configuration);
    const auto& training = configuration_->scenario.training;
    if (!training)
      return Error{path_ + ": scenario '" + configuration_->scenario.name +
                   "' has no 'training': there is nothing to grade"};
    if (const Status known = tick::check_training(*configuration_); !known)
      return Error{path_ + ": " + known.error().message};
    graders_ = tick::make_graders(*configuration_, SimulationTime{header.stamp.ns});
    return {};
  }

  std::string path_;
  std::optional<tick::Configuration> configuration_;
  std::vector<training::Grader> graders_;
  WorldMessage world_;
};

SessionGrading::SessionGrading(std::string path) : reading_(std::make_unique<Reading>(std::move(path))) {}
SessionGrading::~SessionGrading() = default;
Status SessionGrading::take(const Message& message) { return reading_->take(message); }
const tick::Configuration* SessionGrading::configuration() const { return reading_->configuration(); }
const training::Grader* SessionGrading::grader(const std::string& robot) const {
  return reading_->grader(robot);
}
Result<std::vector<GradedSession>> SessionGrading::results(std::uint64_t skipped_bytes) const {
  return reading_->results(skipped_bytes);
}

Result<GradedSession> grade_session(const std::string& path,
                                    const std::function<void(std::uint64_t, std::uint64_t)>& progress,
                                    const std::string& robot) {
  auto all = grade_robots(path, progress);
  if (!all) return all.error();
  std::string names;
  for (GradedSession& each : *all) {
    if (robot.empty() || each.robot == robot) return std::move(each);
    names += (names.empty() ? "" : ", ") + each.robot;
  }
  return Error{path + ": no robot '" + robot + "' is graded in it; graded: " + names};
}

Result<std::vector<GradedSession>> grade_robots(
    const std::string& path, const std::function<void(std::uint64_t, std::uint64_t)>& progress) {
  auto reader = LogReader::open(path);
  if (!reader) return reader.error();
  SessionGrading reading(path);
  while (true) {
    auto next = reader->next();
    if (!next) continue;  // damage: counted below, reading continues after it
    if (!*next) break;
    if (const Status taken = reading.take(**next); !taken) return taken.error();
    if (progress) progress(reader->offset(), reader->size());
  }
  return reading.results(reader->skipped_bytes());
}

std::string to_text(const GradedSession& session) {
  const training::Grade& grade = session.grade;
  char line[64];
  std::string text = session.robot + ": " + training::verdict_text(grade) +
                     (grade.complete ? "\n" : " (INCOMPLETE: the log stops in the middle)\n");
  const auto by = [](const std::optional<Event>& cause) {
    return cause ? "  " + training::event_text(cause) : "";
  };
  for (const training::TaskGrade& task : grade.tasks) {
    std::snprintf(line, sizeof line, "  %+8.2f  %-12s", task.points, to_string(task.outcome));
    text += (task.ended ? at_text(*task.ended, grade.begin) : "         -") + line + task.name +
            (task.required ? " (required)" : "") + by(task.cause) + "\n";
  }
  for (const training::Deduction& deduction : grade.deductions) {
    std::snprintf(line, sizeof line, "  %+8.2f  %-12s", -deduction.points, "penalty");
    text += at_text(deduction.at, grade.begin) + line + deduction.rule + by(deduction.cause) + "\n";
  }
  if (session.skipped_bytes > 0)
    text += "  " + std::to_string(session.skipped_bytes) +
            " bytes of the log are damaged: what they held is not graded\n";
  return text;
}

std::string to_json(const GradedSession& session) {
  nlohmann::ordered_json json{{"log", session.log},
                              {"scenario", session.scenario},
                              {"robot", session.robot},
                              {"skipped_bytes", session.skipped_bytes}};
  training::put_grade(session.grade, json);
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace parhelion::runtime
