#include "server/review/gathering.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "protocols/channels.hpp"
#include "protocols/nearest_name.hpp"

namespace parhelion::review {

Gathering::Gathering(const std::string& path, const ReviewLimits& limits, Reader reader, std::string robot)
    : limits_(limits),
      reader_(reader),
      path_(path),
      grading_(path),
      pictures_(limits.deduction_pictures, limits.strip_pictures) {
  review_.log = std::filesystem::path(path).filename().string();
  review_.robot = std::move(robot);
}

Status Gathering::take(Message& message) {
  if (const Status status = grade(message); !status) return status;
  if (!configuration_) return {};
  const auto handler = handlers_.find(message.channel);
  return handler == handlers_.end() ? Status{} : (this->*handler->second)(message);
}

/// Without training, the review has no score.
Status Gathering::grade(const Message& message) {
  const bool first = message.channel == channel::kMrSession;
  if (!graded_) return first ? Status{Error{path_ + ": a second MR_SESSION"}} : Status{};
  const Status taken = grading_.take(message);
  if (first && !configuration_) {
    const tick::Configuration* configuration = grading_.configuration();
    graded_ = taken.ok();
    if (configuration && (taken.ok() || !configuration->scenario.training)) {
      configuration_ = configuration;
      return begin(message);
    }
  }
  if (!taken) return taken;
  if (!configuration_) return {};
  const training::Grader* grader = grading_.grader(review_.robot);
  if (grader == nullptr) return {};
  const auto& deductions = grader->deductions();
  for (; handled_deductions_ < deductions.size(); ++handled_deductions_)
    pictures_.handle_deduction(deductions[handled_deductions_].points);
  return {};
}

Status Gathering::begin(const Message& message) {
  SessionHeader header;
  if (const Status read = decode(message.channel, message.payload, header); !read) return read;
  review_.begin = SimulationTime{header.stamp.ns};
  review_.scenario = configuration_->scenario;
  if (const Status known = choose_robot(); !known) return known;
  review_.plan = plan_of(configuration_->model);
  listen(channel::kMrEvents, &Gathering::event);
  listen(channel::kMrWorld, &Gathering::world);
  listen(channel::kMrCamera, &Gathering::picture);
  listen(channel::kLoop, &Gathering::loop);
  if (!tick::simulates_trainee(review_.scenario)) {
    listen(channel::kScan, &Gathering::real_scan);
    listen(channel::kCamera, &Gathering::real_picture);
  }
  if (for_trainee()) begin_knowledge();
  if (robot_) {
    listen_to_robot(*robot_);
  } else {
    handlers_["MR_AGENT_" + review_.robot + "_TELEOP"] = &Gathering::asked;
  }
  return {};
}

Status Gathering::choose_robot() {
  const std::vector<std::string> graded = tick::graded_robots(*configuration_);
  std::string& robot = review_.robot;
  if (robot.empty()) robot = graded.front();
  robot_ = configuration_->find_robot(robot);
  if (robot_ || robot == graded.front()) return {};
  std::vector<std::string> known{configuration_->robot.name};
  for (const RobotDescription& other : configuration_->other_robots) known.push_back(other.name);
  return Error{path_ + ": no robot '" + robot + "' in it" + suggestion_or_known(robot, known)};
}

void Gathering::listen_to_robot(std::size_t robot) {
  const RobotDescription& description = configuration_->robot_at(robot);
  review_.footprint = description.footprint;
  nearest_.emplace(description);
  listen(channel::kMrScan, &Gathering::scan);
  listen(channel::kMrScanInfo, &Gathering::scan_info);
  for (std::size_t i = 1; i <= description.further_lasers.size(); ++i)
    handlers_[configuration_->channels.robots_bus(channel::kMrScanInfo, robot, i)] =
        &Gathering::further_scan_info;
  listen(channel::kTeleop, &Gathering::asked);
  listen(channel::kMrCmd, &Gathering::given);
}

void Gathering::begin_knowledge() {
  shapes_.emplace(configuration_->scenario, configuration_->robot, configuration_->model,
                  configuration_->robot_models);
  for (const RobotDescription& other : configuration_->other_robots) shapes_->add(other);
  shapes_->add(configuration_->objects);
  knowledge_.emplace(*configuration_, *shapes_);
  view_.emplace(*configuration_, *knowledge_, std::vector<std::string>{review_.robot});
  listen(channel::kMrSpawn, &Gathering::spawn);
}

/// Of zones, paths and what decided points; events were left out as they came.
void Gathering::leave_out_what_was_not_sensed() {
  review_.scenario.zones = view_->zones();
  for (Trail& trail : review_.agents) trail.entity = view_->name_of(trail.entity);
  if (!review_.grade) return;
  const auto restrict_cause = [&](std::optional<Event>& cause) {
    if (!cause) return;
    cause = view_->event(*cause);
    if (cause) cause->position.setZero();
  };
  for (training::TaskGrade& task : review_.grade->tasks) restrict_cause(task.cause);
  for (training::Deduction& deduction : review_.grade->deductions) restrict_cause(deduction.cause);
}

Result<SessionReview> Gathering::result(std::uint64_t skipped_bytes) {
  if (!configuration_)
    return Error{path_ + ": no MR_SESSION in it; expected a session log, as serve and replay -o write it"};
  if (graded_) {
    auto graded = grading_.results(skipped_bytes);
    if (!graded) return graded.error();
    for (runtime::GradedSession& each : *graded)
      if (each.robot == review_.robot) review_.grade = std::move(each.grade);
  }
  // Events at the start of the session are published with the first graded event, after others.
  std::stable_sort(review_.events.begin(), review_.events.end(),
                   [](const Event& a, const Event& b) { return a.stamp < b.stamp; });
  review_.cut_off = !ended_;
  review_.skipped_bytes = skipped_bytes;
  for (auto& [name, trail] : trails_) {
    if (name == review_.robot)
      review_.path = std::move(trail);
    else
      review_.agents.push_back(std::move(trail));
  }
  for (Trail& trail : review_.agents)
    trail.track.allow(std::max<std::size_t>(limits_.agent_points / review_.agents.size(), 2));
  if (for_trainee()) leave_out_what_was_not_sensed();
  review_.pictures_seen = pictures_.seen();
  review_.pictures = pictures_.finish(review_.pictures_unreadable);
  return std::move(review_);
}

}  // namespace parhelion::review
