#include "server/review/review.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "server/review/nearest_return.hpp"
#include "server/runtime/trainee_view.hpp"

namespace parhelion::review {
namespace {

/// Reads the log's messages into a review.
class Gathering {
 public:
  Gathering(const std::string& path, const ReviewLimits& limits, Reader reader)
      : limits_(limits),
        reader_(reader),
        path_(path),
        grading_(path),
        pictures_(limits.deduction_pictures, limits.strip_pictures) {
    review_.log = std::filesystem::path(path).filename().string();
  }

  Status take(Message& message);
  Result<SessionReview> result(std::uint64_t skipped_bytes);

 private:
  using Handler = Status (Gathering::*)(Message&);

  Status begin(const Message& message);
  void listen(const std::string& canonical, Handler handler) {
    handlers_[configuration_->channels.bus(canonical)] = handler;
  }
  Status grade(const Message& message);
  Status event(Message& message);
  Status world(Message& message);
  Status scan(Message& message);
  Status scan_info(Message& message);
  Status further_scan_info(Message& message);
  Status asked(Message& message);
  Status given(Message& message);
  Status picture(Message& message);
  Status loop(Message& message);
  Status spawn(Message& message);
  Status real_scan(Message& message) { return delay("delay_scan", message); }
  Status real_picture(Message& message) { return delay("delay_camera", message); }

  Status delay(const char* name, const Message& message);
  bool for_trainee() const { return reader_ == Reader::trainee; }
  void begin_knowledge();
  bool senses(const std::string& entity) const;
  void leave_out_what_was_not_sensed();
  void measure_nearest();
  void follow(const WorldMessage::Entry& body, double t);
  void attitude(const WorldMessage::Entry& body, double t, bool known);
  void list(Event&& event);
  void add(const std::string& name, double t, double value) {
    if (!std::isfinite(value)) return;  // skips missing values
    review_.series.try_emplace(name, limits_.windows).first->second.add(t, value);
  }
  double at(ArrivalTime arrival) { return seen(simulation_time(arrival)); }
  double seen(SimulationTime stamp) {
    const double t = (stamp - review_.begin).seconds();
    review_.duration = std::max(review_.duration, t);
    return t;
  }

  ReviewLimits limits_;
  Reader reader_;
  std::string path_;
  runtime::SessionGrading grading_;
  bool graded_ = true, ended_ = false;
  const tick::Configuration* configuration_ = nullptr;
  std::map<std::string, Handler, std::less<>> handlers_;
  SessionReview review_;
  std::optional<NearestReturn> nearest_;
  PictureChoice pictures_;
  std::size_t handled_deductions_ = 0;
  WorldMessage world_;
  Scan scan_;
  ScanInfo info_;
  bool have_scan_ = false, have_info_ = false;
  std::map<std::string, Trail, std::less<>> trails_;
  std::map<std::string, std::uint32_t, std::less<>> epochs_;
  std::map<EventKind, std::size_t> listed_;
  // Of a trainee's review.
  std::optional<simulation::EntityShapes> shapes_;
  std::optional<runtime::Knowledge> knowledge_;
  std::optional<runtime::TraineeView> view_;
};

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
  const auto& deductions = grading_.grader()->deductions();
  for (; handled_deductions_ < deductions.size(); ++handled_deductions_)
    pictures_.handle_deduction(deductions[handled_deductions_].points);
  return {};
}

Status Gathering::begin(const Message& message) {
  SessionHeader header;
  if (const Status read = decode(message.channel, message.payload, header); !read) return read;
  review_.begin = SimulationTime{header.stamp.ns};
  review_.scenario = configuration_->scenario;
  review_.robot = tick::graded_robot(*configuration_);
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
  if (review_.robot == configuration_->robot.name) {
    review_.footprint = configuration_->robot.footprint;
    nearest_.emplace(configuration_->robot);
    listen(channel::kMrScan, &Gathering::scan);
    listen(channel::kMrScanInfo, &Gathering::scan_info);
    for (std::size_t i = 1; i <= configuration_->robot.further_lasers.size(); ++i)
      handlers_[configuration_->channels.robots_bus(channel::kMrScanInfo, 0, i)] =
          &Gathering::further_scan_info;
    listen(channel::kTeleop, &Gathering::asked);
    listen(channel::kMrCmd, &Gathering::given);
  } else {
    handlers_["MR_AGENT_" + review_.robot + "_TELEOP"] = &Gathering::asked;
  }
  return {};
}

void Gathering::begin_knowledge() {
  shapes_.emplace(configuration_->scenario, configuration_->robot, configuration_->model,
                  configuration_->robot_models);
  for (const RobotDescription& other : configuration_->other_robots) shapes_->add(other);
  knowledge_.emplace(*configuration_, *shapes_);
  view_.emplace(*configuration_, *knowledge_, std::vector<std::string>{review_.robot});
  listen(channel::kMrSpawn, &Gathering::spawn);
}

Status Gathering::spawn(Message& message) {
  // The server has refused what cannot be read.
  if (AgentSpawn command; decode(message.channel, message.payload, command).ok()) shapes_->take(command);
  return {};
}

Status Gathering::event(Message& message) {
  Event event;
  if (const Status read = decode(message.channel, message.payload, event); !read) return read;
  seen(event.stamp);
  if (!for_trainee()) {
    list(std::move(event));
    return {};
  }
  shapes_->take(event);
  knowledge_->take(event, world_);
  if (auto visible = view_->event(event)) list(*std::move(visible));
  return {};
}

/// All kinds are represented, however many events there are of one.
void Gathering::list(Event&& event) {
  if (event.kind == EventKind::contact_continues) return;
  if (++listed_[event.kind] <= limits_.events_of_kind)
    review_.events.push_back(std::move(event));
  else
    ++review_.events_left_out[to_string(event.kind)];
}

Status Gathering::world(Message& message) {
  if (const Status read = decode(message.channel, message.payload, world_); !read) return read;
  const double t = seen(SimulationTime{world_.stamp.ns});
  if (for_trainee() && review_.robot != configuration_->robot.name)
    if (const AgentDefinition* agent = shapes_->definition(review_.robot))
      knowledge_->handle_scan_of(*agent, world_);
  const std::string* before = nullptr;  // the bodies of an entity are consecutive, and only the first one
                                        // counts
  for (const WorldMessage::Entry& body : world_.bodies) {
    if (body.owner == BodyOwner::building || (before && *before == body.entity)) continue;
    before = &body.entity;
    if (for_trainee() && !view_->may_follow(body.entity) && !senses(body.entity)) continue;
    follow(body, t);
    if (body.entity == review_.robot) attitude(body, t, body.attitude_known);
  }
  return {};
}

/// True while the trainee's robot senses the entity.
bool Gathering::senses(const std::string& entity) const {
  const runtime::Sensed* sensed = view_->sensed(entity);
  return sensed != nullptr && SimulationTime{world_.stamp.ns} - sensed->last < runtime::kSensedNow;
}

void Gathering::follow(const WorldMessage::Entry& body, double t) {
  auto [trail, is_new] = trails_.try_emplace(body.entity);
  if (is_new) trail->second = {body.entity, body.kind, Track(limits_.path_points)};
  auto [epoch, first] = epochs_.try_emplace(body.entity, body.epoch);
  const Eigen::Vector3d p = body.T_map_body.translation();
  trail->second.track.add({t, p.x(), p.y(), body.T_map_body.yaw(), body.velocity.head<2>().norm(),
                           first || epoch->second != body.epoch});
  epoch->second = body.epoch;
}

void Gathering::attitude(const WorldMessage::Entry& body, double t, bool known) {
  add("speed", t, body.velocity.head<2>().norm());
  if (!known) return;
  constexpr double degrees = 180 / std::numbers::pi;
  const Eigen::Matrix3d R = body.T_map_body.rotation();
  // Positive: nose up, left side up.
  add("pitch", t, degrees * std::asin(std::clamp(R(2, 0), -1.0, 1.0)));
  add("roll", t, degrees * std::atan2(R(2, 1), R(2, 2)));
}

Status Gathering::scan(Message& message) {
  have_scan_ = false;
  // Malformed scans were passed on unchanged; they contain nothing to measure.
  if (!decode(message.channel, message.payload, scan_)) return {};
  have_scan_ = true;
  at(message.arrival);
  measure_nearest();
  return {};
}

Status Gathering::scan_info(Message& message) {
  have_info_ = false;
  if (const Status read = decode(message.channel, message.payload, info_); !read) return read;
  have_info_ = true;
  if (for_trainee() && info_.live)
    knowledge_->handle_scan(info_, configuration_->find_robot(review_.robot).value_or(0), world_);
  measure_nearest();
  return {};
}

/// Of a laser after the first.
Status Gathering::further_scan_info(Message& message) {
  ScanInfo info;
  if (const Status read = decode(message.channel, message.payload, info); !read) return read;
  if (for_trainee() && info.live) knowledge_->handle_scan(info, 0, world_);
  return {};
}

/// The two messages arrive in either order.
void Gathering::measure_nearest() {
  if (!have_scan_ || !have_info_ || scan_.stamp != info_.stamp) return;
  have_scan_ = have_info_ = false;
  const auto distances = nearest_->of(scan_, &info_);
  add("nearest", review_.duration, distances.any);
  add("nearest_injected", review_.duration, distances.injected);
}

Status Gathering::asked(Message& message) {
  TwistCommand command;
  // The server has refused a malformed input, so it commanded nothing.
  if (!decode(message.channel, message.payload, command)) return {};
  const double t = at(message.arrival);
  add("asked_forward", t, command.twist.vx);
  add("asked_turn", t, command.twist.wz);
  return delay("delay_teleop", message);
}

Status Gathering::given(Message& message) {
  TwistCommand command;
  if (const Status read = decode(message.channel, message.payload, command); !read) return read;
  const double t = at(message.arrival);
  add("given_forward", t, command.twist.vx);
  add("given_turn", t, command.twist.wz);
  return {};
}

Status Gathering::picture(Message& message) {
  const auto robot = configuration_->find_robot(review_.robot);
  if (for_trainee() && robot) knowledge_->handle_picture(*robot, world_);
  pictures_.saw(at(message.arrival), std::move(message.payload));
  return {};
}

Status Gathering::loop(Message& message) {
  LoopDecision decision;
  if (const Status read = decode(message.channel, message.payload, decision); !read) return read;
  if (decision.kind == LoopDecision::Kind::ended) ended_ = true;
  return {};
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

/// Reads the stamp from the bytes. The server has refused messages that are malformed otherwise.
Status Gathering::delay(const char* name, const Message& message) {
  const auto stamp = leading_stamp(message.payload);
  if (!stamp) return {};
  const double late = Duration{message.arrival.ns - stamp->ns}.seconds();
  const auto [smallest, first] = review_.min_delay.try_emplace(name, late);
  if (!first) smallest->second = std::min(smallest->second, late);
  add(name, at(message.arrival), late);
  return {};
}

Result<SessionReview> Gathering::result(std::uint64_t skipped_bytes) {
  if (!configuration_)
    return Error{path_ + ": no MR_SESSION in it; expected a session log, as serve and replay -o write it"};
  if (graded_) {
    auto session = grading_.result(skipped_bytes);
    if (!session) return session.error();
    review_.grade = std::move(session->grade);
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

}  // namespace

Result<SessionReview> review_session(const std::string& path, const ReviewLimits& limits,
                                     const std::function<void(std::uint64_t, std::uint64_t)>& progress,
                                     Reader for_whom) {
  auto reader = LogReader::open(path);
  if (!reader) return reader.error();
  Gathering gathering(path, limits, for_whom);
  while (true) {
    auto next = reader->next();
    if (!next) continue;  // damage: counted below; reading continues behind it
    if (!*next) break;
    if (const Status taken = gathering.take(**next); !taken) return taken.error();
    if (progress) progress(reader->offset(), reader->size());
  }
  return gathering.result(reader->skipped_bytes());
}

}  // namespace parhelion::review
