// Inputs and physics steps of a live session.
#include "server/runtime/live_session.hpp"

#include <algorithm>
#include <chrono>
#include <thread>

#include "protocols/channels.hpp"
#include "protocols/driving_timing.hpp"
#include "server/runtime/session_state.hpp"
#include "server/tick/emergency_stop.hpp"
#include "server/tick/instructor_input.hpp"

namespace parhelion::runtime {
namespace {

constexpr int kLaserThreads = 2;  // the tick's own and one more: further cores render and encode
constexpr int kRenderNice = 10;   // rendering never takes a core from the tick
constexpr int kMappingNice = 15;  // mapping neither, nor from rendering
constexpr Duration kBehind =
    milliseconds(250);  // physics later than this is skipped, with a record in the log
constexpr Duration kIdle = milliseconds(100);
constexpr std::size_t kRefusalsATurn =
    8;  // between two inputs, so that neither a scan nor a stop waits for many
constexpr int kStopRepeats = 2;
constexpr Duration kStopPause = milliseconds(20);  // a burst of losses is often shorter

Message loop_message(LoopDecision::Kind kind, ArrivalTime stamp, std::uint64_t count) {
  LoopDecision decision;
  decision.stamp = {stamp.ns};
  decision.kind = kind;
  decision.count = static_cast<std::int64_t>(count);
  Message message{channel::kLoop, stamp, {}};
  encode(decision, message.payload);
  return message;
}

}  // namespace

LiveSession::LiveSession(Bus& bus, const tick::Configuration& configuration, const ServeOptions& options,
                         std::optional<LogWriter> log)
    : configuration_(configuration),
      options_(options),
      real_time_(options.real_time),
      sent_(configuration),
      outbox_(&bus, std::move(log), &sent_),
      log_watch_(options.session),
      guards_(make_guards()),
      inbox_(bus, configuration, guards(), options.inbox, &sent_, options.clock),
      renderer_(
          configuration.model, tick::simulates_trainee(configuration.scenario), kRenderNice,
          [this] { inbox_.wake(); }, options.texture),
      stages_(configuration.robot_count()),
      in_to_out_us_(configuration.robot_count()),
      robot_stopped_(configuration.robot_count()),
      commanded_(configuration.robot_count()) {
  if (configuration.scenario.mapping && options.update_site)
    views_.emplace(options.update_site, configuration, kMappingNice);
}

std::vector<std::vector<std::unique_ptr<Guard>>> LiveSession::make_guards() {
  std::vector<std::vector<std::unique_ptr<Guard>>> made(configuration_.robot_count());
  for (std::size_t i = 0; i < made.size(); ++i) {
    for (std::size_t laser = 0; laser <= configuration_.robot_at(i).further_lasers.size(); ++laser) {
      const std::string& mr_scan = configuration_.channels.robots_bus(channel::kMrScan, i, laser);
      made[i].push_back(std::make_unique<Guard>(
          options_.guard,
          [this, &mr_scan](std::span<const std::uint8_t> scan) { outbox_.publish_now(mr_scan, scan); }));
    }
  }
  return made;
}

Guards LiveSession::guards() const {
  Guards all(guards_.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (const auto& each : guards_[i]) all[i].push_back(each.get());
  }
  return all;
}

Status LiveSession::start() {
  started_ = last_ = inbox_.stamp();
  auto made = make_session_state(configuration_, started_, kLaserThreads);
  if (!made) return made.error();
  state_ = std::move(*made);
  tick::Outputs::Entry header{channel::kMrSession, {}};
  encode(tick::session_header(configuration_, {started_.ns}), header.payload);
  outbox_.send(nullptr, {&header, 1}, started_);
  if (!outbox_.complete()) return Error{outbox_.log_error()};
  for (const std::string& robot : options_.stopped_robots) keep_robot_stopped(robot);
  return {};
}

/// As a normal input, so that replay applies it, too.
void LiveSession::keep_robot_stopped(const std::string& robot) {
  const Message stop = tick::emergency_stop_message(configuration_, robot, inbox_.stamp());
  last_ = stop.arrival;
  outputs_.clear();
  tick::tick(configuration_, stop, *state_, outputs_, stages_);
  report_robot_stops();
  outbox_.send(&stop, outputs_.entries(), stop.arrival);
  if (options_.notify)
    options_.notify(
        "the emergency stop of '" + robot +
        "' was active when the previous server ended, and still is: release it at the base station, "
        "or by: parhelion "
        "inject release-emergency-stop --name " +
        robot);
}

void LiveSession::report_robot_stops() {
  for (const tick::RobotState& robot : state_->robots) {
    const bool stopped = robot.command.emergency_stop;
    if (stopped == robot_stopped_[robot.index]) continue;
    robot_stopped_[robot.index] = stopped;
    if (options_.robot_stop_held) options_.robot_stop_held(robot.name, stopped);
  }
}

void LiveSession::report_commanded(std::size_t robot) {
  const tick::CommandState& command = state_->robots[robot].command;
  if (!options_.commanded || tick::simulates_trainee(configuration_.scenario)) return;
  if (!command.teleop && command.joint_command.names.empty()) return;
  RobotStop stop = commanded_[robot];
  stop.command_channel = configuration_.channels.robots_bus(channel::kMrCmd, robot);
  stop.command_type = configuration_.robot_at(robot).command_type;
  stop.joint_channel = configuration_.channels.robots_bus(channel::kMrJointCmd, robot);
  for (const std::string& joint : command.joint_command.names) {
    if (std::find(stop.joints.begin(), stop.joints.end(), joint) == stop.joints.end())
      stop.joints.push_back(joint);
  }
  if (stop == commanded_[robot]) return;
  commanded_[robot] = std::move(stop);
  std::vector<RobotStop> all;
  for (const RobotStop& each : commanded_)
    if (!each.command_channel.empty()) all.push_back(each);
  options_.commanded(all);
}

/// A datagram may be lost: the stop of a real robot goes out twice more. The log has the first.
void LiveSession::repeat_stop() {
  if (tick::simulates_trainee(configuration_.scenario)) return;
  const auto is_stop = [this](const std::string& name) {
    for (std::size_t i = 0; i < configuration_.robot_count(); ++i) {
      for (const char* canonical : {channel::kMrCmd, channel::kMrJointCmd})
        if (configuration_.channels.robots_bus(canonical, i) == name) return true;
    }
    return false;
  };
  for (int i = 0; i < kStopRepeats; ++i) {
    bool commanded = false;
    for (const tick::Outputs::Entry& entry : outputs_.entries()) {
      if (!is_stop(entry.channel)) continue;
      if (!commanded) std::this_thread::sleep_for(std::chrono::nanoseconds(kStopPause.ns));
      commanded = true;
      outbox_.publish_now(entry.channel, entry.payload);
    }
  }
}

Result<Report> LiveSession::operator()() {
  if (options_.real_time == RealTime::on && !real_time_.holds()) return Error{real_time_.note()};
  if (const Status begun = start(); !begun) return begun.error();
  if (options_.begun) options_.begun();
  if (options_.notify) options_.notify("serving; stop with ^C");
  const std::string fault = run_until_stopped();
  if (options_.loop_ended) options_.loop_ended();
  end();
  if (!fault.empty()) return Error{fault};
  Report whole = report();
  whole.grades = grades_now(configuration_, state_->grading.get(), options_.session);
  if (!whole.grades.empty()) whole.grade = whole.grades.front();
  whole.hash = outbox_.hashes();
  return whole;
}

/// Returns the transport's fault; empty: stopped by request.
std::string LiveSession::run_until_stopped() {
  while (!options_.stop || !options_.stop()) {
    if (auto arrived = inbox_.take(steady_now() + until_step())) {
      handle(std::move(*arrived));
    } else if (std::string fault = inbox_.fault(); !fault.empty()) {
      return fault;
    } else if (step_is_due()) {
      step_on_time();
    }
    note_given_up();
    refuse_late_commands(kRefusalsATurn);
    take_answers();
    take_models();
    report_lost_log();
    housekeeping();
    if (options_.loop_runs) options_.loop_runs();
  }
  return {};
}

/// Processes and logs all received inputs, scans in particular.
void LiveSession::end() {
  inbox_.close();
  while (auto arrived = inbox_.take(steady_now())) {
    handle(std::move(*arrived));
    take_answers();
  }
  note_given_up();
  refuse_late_commands(Inbox::kMaxRefusals);
  decide_now(LoopDecision::Kind::ended, 0);
  outputs_.clear();
  tick::finish(configuration_, *state_, outputs_);
  outbox_.send(nullptr, outputs_.entries(), last_);
  repeat_stop();
  send_frames();
  renderer_.wait();
  if (agents_renderer_) agents_renderer_->wait();
  take_answers();
  syncer_.request_stop();
  syncer_.join();
  check_log();
  (void)outbox_.sync();
  report_lost_log();
}

void LiveSession::handle(Arrived arrived) {
  const Message& message = arrived.message;
  // The decision to skip precedes the input, so it has an earlier stamp.
  if (skip_late_steps(arrived.message.arrival)) arrived.message.arrival = inbox_.stamp();
  last_ = message.arrival;
  if (is_stale_command(arrived)) {
    decide(LoopDecision::Kind::stale_command, static_cast<std::uint64_t>(arrived.age.ns / 1'000'000),
           message.arrival);
    return;
  }
  if (configuration_.channels.kind(message.channel) == tick::InputKind::scan) return handle_scan(arrived);
  const bool command = tick::is_command(configuration_.channels.kind(message.channel));
  if (command && refuse_unwritable(message)) return;
  outputs_.clear();
  tick::tick(configuration_, message, *state_, outputs_, stages_);
  if (command) report_robot_stops();
  report_commanded(arrived.robot);
  outbox_.send(command ? nullptr : &message, outputs_.entries(), message.arrival);
  send_frames();
  if (views_ && arrived.sensor == 0)
    views_->offer(configuration_.channels.kind(message.channel), state_->robots.front());
}

bool LiveSession::is_stale_command(const Arrived& arrived) const {
  const tick::InputKind kind = configuration_.channels.kind(arrived.message.channel);
  return (kind == tick::InputKind::teleop || kind == tick::InputKind::joint_command) &&
         arrived.age > driving_timing::kMaxQueueAge;
}

/// A command is logged before it is applied; if that fails, it is refused. A stop of the robot is applied
/// anyway.
bool LiveSession::refuse_unwritable(const Message& message) {
  if (outbox_.write_input(message) || tick::stops_robot(configuration_, message)) return false;
  InstructorCommand command;
  Event event;
  event.stamp = simulation_time(message.arrival);
  event.kind = EventKind::command_refused;
  if (tick::read_command(configuration_.channels, message, command).ok()) {
    event.request = request_of(command);
    event.subject = subject_of(command);
  }
  event.text = "the session log cannot be written: " + outbox_.log_error();
  tick::Outputs::Entry answer{configuration_.channels.bus(channel::kMrEvents), {}};
  encode(event, answer.payload);
  outbox_.send(nullptr, {&answer, 1}, message.arrival);
  return true;
}

/// Before any write, and before the server uses the scan for its own state. If the guard fired first, the log
/// gets what the guard published.
tick::ScanSink::Receipt LiveSession::publish(std::uint64_t number, std::span<const std::uint8_t> mr_scan) {
  const std::size_t robot = scan_->arrived.robot;
  const bool in_time = guard_of(scan_->arrived).answer(scan_->arrived.ticket, mr_scan);
  in_to_out_us_[robot].add((steady_now() - scan_->arrived.received).microseconds());
  scan_->number = number;
  scan_->receipt = {.sent = true, .raw = !in_time};
  return *scan_->receipt;
}

void LiveSession::handle_scan(const Arrived& arrived) {
  outputs_.clear();
  stages_.begin(arrived.robot);
  scan_.emplace(ScanInWork{arrived, std::nullopt});
  tick::tick(configuration_, arrived.message, *state_, outputs_, stages_, *this);
  if (!scan_->receipt)
    guard_of(arrived).give_up(
        arrived.ticket);  // not a scan, or a fault of the tick: the robot still gets the raw scan
  std::optional<Message> fired;
  if (scan_->receipt && scan_->receipt->raw) fired = note(LoopDecision::Kind::guard_fired, scan_->number);
  scan_.reset();
  outbox_.send(&arrived.message, outputs_.entries(), arrived.message.arrival, fired ? &*fired : nullptr);
  send_frames();
  if (views_ && arrived.sensor == 0) views_->offer(tick::InputKind::scan, state_->robots.front());
}

/// Real time until the next step, if that is soon.
Duration LiveSession::until_step() const {
  const Duration left{state_->simulation.next_step().ns - inbox_.now().ns};
  const double rate = options_.clock ? options_.clock->rate() : 1;
  return rate > 0 ? std::min(seconds(left.seconds() / rate), kIdle) : kIdle;
}

bool LiveSession::step_is_due() const { return state_->simulation.next_step().ns <= inbox_.now().ns; }

void LiveSession::step_on_time() {
  ArrivalTime now = inbox_.stamp();
  if (skip_late_steps(now)) now = inbox_.stamp();
  last_ = now;
  outputs_.clear();
  stages_.begin();
  tick::advance(configuration_, now, *state_, outputs_, stages_);
  if (!outputs_.entries().empty()) outbox_.send(nullptr, outputs_.entries(), now);
  send_frames();
}

/// A machine that is too slow skips physics steps instead of accumulating delay. Replay skips the same steps.
/// False: none skipped.
bool LiveSession::skip_late_steps(ArrivalTime now) {
  const Duration late{now.ns - state_->simulation.next_step().ns};
  if (late < kBehind) return false;
  decide(LoopDecision::Kind::steps_skipped, state_->simulation.steps_due(simulation_time(now)) - 1, now);
  return true;
}

/// Logs how many scans the log lacks.
void LiveSession::note_given_up() {
  const std::uint64_t count = inbox_.take_given_up();
  if (count > 0) decide_now(LoopDecision::Kind::scans_left_out, count);
}

/// Replies to commands that the inbox refused. All at one time: a loop that is behind would otherwise do a
/// physics step for each.
void LiveSession::refuse_late_commands(std::size_t max_count) {
  const std::vector<std::uint64_t> requests = inbox_.take_refused_commands(max_count);
  for (std::size_t i = 0; i < requests.size(); ++i) {
    if (i == 0) {
      decide_now(LoopDecision::Kind::late_command, requests[i]);
    } else {
      decide(LoopDecision::Kind::late_command, requests[i], inbox_.next_stamp());
    }
  }
}

void LiveSession::decide_now(LoopDecision::Kind kind, std::uint64_t count) {
  ArrivalTime now = inbox_.stamp();
  if (skip_late_steps(now)) now = inbox_.stamp();
  decide(kind, count, now);
}

/// Applies and logs a decision, which replay repeats.
void LiveSession::decide(LoopDecision::Kind kind, std::uint64_t count, ArrivalTime stamp) {
  last_ = stamp;
  const Message decision = loop_message(kind, stamp, count);
  outputs_.clear();
  tick::tick(configuration_, decision, *state_, outputs_, stages_);
  outbox_.send(&decision, outputs_.entries(), stamp);
  send_frames();  // an image waiting for its depth image may be overdue
}

/// For the log: how a scan or an image was processed, without effect on the session.
Message LiveSession::note(LoopDecision::Kind kind, std::uint64_t sequence) {
  last_ = inbox_.stamp();
  return loop_message(kind, last_, sequence);
}

}  // namespace parhelion::runtime
