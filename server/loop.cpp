#include "server/loop.hpp"

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <thread>

#include "protocols/bus/log_file.hpp"
#include "server/emergency_stop.hpp"
#include "server/guard.hpp"
#include "server/inbox.hpp"
#include "server/render_thread.hpp"
#include "server/sensor_path.hpp"
#include "server/tick.hpp"
#include "server/view_source.hpp"

namespace parhelion {
namespace {

constexpr int laser_threads = 2;  // the tick's own and one beside it: what more there are draws and encodes
constexpr int render_nice = 10;   // rendering never takes a core from the tick
constexpr int agents_nice = 15;   // what agents see, less than what the trainee's robot does
constexpr int mapping_nice = 15;  // nor does mapping, or from rendering
constexpr Duration sync_period = seconds(1.0);  // bounds what a power cut takes (promise 6)
constexpr Duration status_period = seconds(1.0);
constexpr Duration behind = milliseconds(250);  // physics later than this is given up, and the log says so
constexpr Duration idle = milliseconds(100);

Message loop_message(LoopDecision::Kind kind, ArrivalTime stamp, std::uint64_t count) {
  LoopDecision decision;
  decision.stamp = {stamp.ns};
  decision.kind = kind;
  decision.count = static_cast<std::int64_t>(count);
  Message message{channel::loop, stamp, {}};
  encode(decision, message.payload);
  return message;
}

/// One live session.
class Session : private StageObserver {
 public:
  Session(Bus& bus, const Configuration& configuration, const ServeOptions& options,
          std::optional<LogWriter> log)
      : configuration_(configuration),
        options_(options),
        real_time_(options.real_time),
        sent_(configuration),
        outbox_(&bus, std::move(log), &sent_),
        mr_scan_(configuration.channels.bus(channel::mr_scan)),
        guard_(options.guard,
               [this](std::span<const std::uint8_t> scan) { outbox_.publish_now(mr_scan_, scan); }),
        inbox_(bus, configuration.channels, guard_, options.inbox, &sent_, options.clock),
        renderer_(configuration.model, simulates_trainee(configuration.scenario), render_nice) {
    if (configuration.scenario.mapping && options.update_site)
      views_.emplace(options.update_site, configuration, mapping_nice);
  }

  Result<Report> operator()();

 private:
  Status start();
  std::string run_until_stopped();
  void end();
  void handle(Arrived arrived);
  void handle_scan(const Arrived& arrived);
  void ended(Stage stage) override { stages_.ended(stage); }
  void answered(std::span<const std::uint8_t> scan) override;
  bool refuse_unwritable(const Message& message);
  void keep_robot_stopped();
  void tell_robot_stop();
  Duration until_step() const;
  void step_on_time();
  bool skip_late_steps(ArrivalTime now);
  void note_given_up();
  void note_foreign_messages();
  void send_frames();
  void take_answers();
  void take_models();
  void decide(LoopDecision::Kind kind, std::uint64_t count, ArrivalTime stamp);
  Message note(LoopDecision::Kind kind, std::uint64_t sequence);
  void housekeeping();
  void sync_each_second(const std::stop_token& stop);
  void publish_status(ArrivalTime now);
  Report report();

  const Configuration& configuration_;
  const ServeOptions& options_;
  const RealTimeScope real_time_;  // before the threads that scans wait for: they take it over
  SentMessages sent_;
  Outbox outbox_;
  const std::string mr_scan_;
  Guard guard_;
  Inbox inbox_;
  RenderThread renderer_;
  std::optional<RenderThread> agents_renderer_;  // from the first picture of an agent's camera on
  std::optional<ViewSource> views_;
  std::unique_ptr<State> state_;
  Outputs outputs_;
  StageClock stages_;
  const Arrived* scan_ = nullptr;  // the one that is being answered
  enum class Answer : std::uint8_t { none, sent, too_late } answer_ = Answer::none;
  ArrivalTime started_, last_;
  WallTime last_housekeeping_ = steady_now();
  Percentiles frame_us_, in_to_out_us_;
  Percentiles agent_frame_us_;
  std::uint64_t frames_dropped_ = 0, agent_frames_dropped_ = 0;
  bool robot_stopped_ = false;  // as robot_stop_held was told
  std::jthread syncer_{[this](const std::stop_token& stop) { sync_each_second(stop); }};
};

Status Session::start() {
  started_ = last_ = inbox_.stamp();
  auto made = make_state(configuration_, started_, laser_threads);
  if (!made) return made.error();
  state_ = std::move(*made);
  Outputs::Entry header{channel::mr_session, {}};
  encode(session_header(configuration_, {started_.ns}), header.payload);
  outbox_.send(nullptr, {&header, 1}, started_);
  if (!outbox_.complete()) return Error{outbox_.log_error()};
  if (options_.robot_stopped) keep_robot_stopped();
  return {};
}

/// An input like any other: replay obeys it, too.
void Session::keep_robot_stopped() {
  const Message stop = stop_of_robot(configuration_, inbox_.stamp());
  last_ = stop.arrival;
  outputs_.clear();
  tick(configuration_, stop, *state_, outputs_, *this);
  tell_robot_stop();
  outbox_.send(&stop, outputs_.entries(), stop.arrival);
  const std::string& robot = configuration_.robot.name;
  if (options_.say)
    options_.say("the emergency stop of '" + robot +
                 "' held when the server before this one ended, and holds: take it back at the base station, "
                 "or by: parhelion "
                 "inject unfreeze --name " +
                 robot);
}

void Session::tell_robot_stop() {
  if (state_->emergency_stop == robot_stopped_) return;
  robot_stopped_ = state_->emergency_stop;
  if (options_.robot_stop_held) options_.robot_stop_held(robot_stopped_);
}

Result<Report> Session::operator()() {
  if (options_.real_time == RealTime::on && !real_time_.holds()) return Error{real_time_.note()};
  if (const Status begun = start(); !begun) return begun.error();
  if (options_.say) options_.say("serving; stop with ^C");
  const std::string fault = run_until_stopped();
  end();
  if (!fault.empty()) return Error{fault};
  Report whole = report();
  whole.grade = grade_now(configuration_, *state_);
  if (whole.grade) whole.grade->log = options_.session;
  whole.hash = outbox_.hashes();
  return whole;
}

/// Why receiving has ended; empty: told to stop.
std::string Session::run_until_stopped() {
  while (!options_.stop || !options_.stop()) {
    if (auto arrived = inbox_.take(steady_now() + until_step())) {
      handle(std::move(*arrived));
    } else if (std::string fault = inbox_.fault(); !fault.empty()) {
      return fault;
    } else {
      step_on_time();
    }
    note_given_up();
    take_answers();
    take_models();
    housekeeping();
  }
  return {};
}

/// What has come is answered and logged, scans above all.
void Session::end() {
  inbox_.close();
  while (auto arrived = inbox_.take(steady_now())) {
    handle(std::move(*arrived));
    take_answers();
  }
  note_given_up();
  const ArrivalTime ended = inbox_.stamp();
  decide(LoopDecision::Kind::ended, 0, skip_late_steps(ended) ? inbox_.stamp() : ended);
  outputs_.clear();
  flush_images(configuration_, *state_, outputs_);
  outbox_.send(nullptr, outputs_.entries(), last_);
  send_frames();
  renderer_.wait();
  if (agents_renderer_) agents_renderer_->wait();
  take_answers();
  syncer_.request_stop();
  syncer_.join();
  (void)outbox_.sync();
}

void Session::handle(Arrived arrived) {
  const Message& message = arrived.message;
  // What is skipped is decided before the input, so it has an earlier stamp.
  if (skip_late_steps(arrived.message.arrival)) arrived.message.arrival = inbox_.stamp();
  last_ = message.arrival;
  if (configuration_.channels.kind(message.channel) == InputKind::scan) return handle_scan(arrived);
  const bool command = configuration_.channels.kind(message.channel) == InputKind::agent_command;
  if (command && refuse_unwritable(message)) return;
  outputs_.clear();
  tick(configuration_, message, *state_, outputs_, *this);
  if (command) tell_robot_stop();
  outbox_.send(command ? nullptr : &message, outputs_.entries(), message.arrival);
  send_frames();
  if (views_) views_->offer(configuration_.channels.kind(message.channel), *state_);
}

/// A command is written before anything is done about it; where it cannot be, it is refused and nothing is
/// done. A robot is stopped all the same.
bool Session::refuse_unwritable(const Message& message) {
  if (outbox_.write_input(message) || stops_robot(configuration_, message)) return false;
  AgentCommand command;
  Event event;
  event.stamp = simulation_time(message.arrival);
  event.kind = EventKind::command_refused;
  if (decode(message.channel, message.payload, command).ok()) {
    event.request = command.request;
    event.subject = command.agent.name;
  }
  event.text = "the session log cannot be written: " + outbox_.log_error();
  Outputs::Entry answer{configuration_.channels.bus(channel::mr_events), {}};
  encode(event, answer.payload);
  outbox_.send(nullptr, {&answer, 1}, message.arrival);
  return true;
}

/// Before anything is written, and before the server learns anything for itself from that scan.
void Session::answered(std::span<const std::uint8_t> scan) {
  if (scan_ == nullptr) return;
  answer_ = guard_.answer(scan_->ticket, scan) ? Answer::sent : Answer::too_late;
  in_to_out_us_.add((steady_now() - scan_->received).microseconds());
}

/// If the guard was first, what it sent is what the log gets.
void Session::handle_scan(const Arrived& arrived) {
  outputs_.clear();
  stages_.begin();
  scan_ = &arrived;
  answer_ = Answer::none;
  tick(configuration_, arrived.message, *state_, outputs_, *this);
  scan_ = nullptr;
  if (answer_ == Answer::none)
    guard_.give_up(arrived.ticket);  // no scan, or a fault of the tick: the robot does not go blind
  std::optional<Message> fired;
  if (answer_ == Answer::too_late) {
    substitute_raw_scan(configuration_, arrived.message, *state_, outputs_);
    fired = note(LoopDecision::Kind::guard_fired, state_->scan.sequence);
  }
  outbox_.send(&arrived.message, outputs_.entries(), arrived.message.arrival, mr_scan_,
               fired ? &*fired : nullptr);
  send_frames();
  if (views_) views_->offer(InputKind::scan, *state_);
}

/// Real time until the next step is due, if that is soon.
Duration Session::until_step() const {
  const Duration left{state_->simulation.next_step().ns - inbox_.now().ns};
  const double rate = options_.clock ? options_.clock->rate() : 1;
  return rate > 0 ? std::min(seconds(left.seconds() / rate), idle) : idle;
}

void Session::step_on_time() {
  ArrivalTime now = inbox_.stamp();
  if (skip_late_steps(now)) now = inbox_.stamp();
  last_ = now;
  outputs_.clear();
  stages_.begin();
  advance(configuration_, now, *state_, outputs_, *this);
  if (!outputs_.entries().empty()) outbox_.send(nullptr, outputs_.entries(), now);
  send_frames();
}

/// A machine that cannot keep up skips physics rather than falling behind without end. Replay must skip the
/// same. False: it keeps up.
bool Session::skip_late_steps(ArrivalTime now) {
  const Duration late{now.ns - state_->simulation.next_step().ns};
  if (late < behind) return false;
  decide(LoopDecision::Kind::steps_skipped, state_->simulation.steps_due(simulation_time(now)) - 1, now);
  return true;
}

/// The log says what it lacks.
void Session::note_given_up() {
  const std::uint64_t count = inbox_.take_given_up();
  if (count > 0) decide(LoopDecision::Kind::scans_left_out, count, inbox_.stamp());
}

/// Obeyed here as in replay.
void Session::decide(LoopDecision::Kind kind, std::uint64_t count, ArrivalTime stamp) {
  last_ = stamp;
  const Message decision = loop_message(kind, stamp, count);
  outputs_.clear();
  tick(configuration_, decision, *state_, outputs_, *this);
  outbox_.send(&decision, outputs_.entries(), stamp);
  send_frames();  // an image that waited for its depth may have waited long enough
}

/// For the log: how a scan or an image was answered. Nothing more comes of it.
Message Session::note(LoopDecision::Kind kind, std::uint64_t sequence) {
  last_ = inbox_.stamp();
  return loop_message(kind, last_, sequence);
}

void Session::send_frames() {
  for (Outputs::Frame& frame : outputs_.frames()) {
    const bool agents = !frame.agent.empty();
    if (agents && !agents_renderer_) agents_renderer_.emplace(configuration_.model, true, agents_nice);
    const auto dropped = (agents ? *agents_renderer_ : renderer_).submit_newest(std::move(frame));
    if (!dropped) continue;
    ++(agents ? agent_frames_dropped_ : frames_dropped_);
    const Message decision = note(LoopDecision::Kind::frame_dropped, *dropped);
    outbox_.send(&decision, {}, last_);
  }
  outputs_.frames().clear();
}

void Session::take_answers() {
  const auto take = [this](RenderThread& renderer, Percentiles& latency_us) {
    while (auto done = renderer.take(false)) {
      Outputs answer;
      add_frame_outputs(configuration_, *done, answer, *state_);
      latency_us.add(done->latency.microseconds());
      outbox_.send(nullptr, answer.entries(), last_);
    }
  };
  take(renderer_, frame_us_);
  if (agents_renderer_) take(*agents_renderer_, agent_frame_us_);
}

/// A model that is ready is an input like any other: stamped, logged, and what replay obeys.
void Session::take_models() {
  while (auto ready = views_ ? views_->take() : std::nullopt) {
    last_ = inbox_.stamp();
    if (skip_late_steps(last_)) last_ = inbox_.stamp();
    Message message{configuration_.channels.bus(channel::mr_model), last_, {}};
    encode(ready->message, message.payload);
    state_->prepared_model = std::move(ready->prepared);
    outputs_.clear();
    const WallTime begun = steady_now();
    tick(configuration_, message, *state_, outputs_, *this);
    outbox_.send(&message, outputs_.entries(), last_);
    views_->held_up(steady_now() - begun);
    send_frames();
  }
}

void Session::housekeeping() {
  if (steady_now() - last_housekeeping_ < status_period) return;
  last_housekeeping_ = steady_now();
  note_foreign_messages();
  publish_status(last_);
}

/// Whoever speaks for the robot is news, not each of the words.
void Session::note_foreign_messages() {
  for (const std::int64_t channel : inbox_.take_foreign(steady_now()))
    decide(LoopDecision::Kind::foreign_message, static_cast<std::uint64_t>(channel), inbox_.stamp());
}

/// On a thread of its own: a slow disk holds up no scan.
void Session::sync_each_second(const std::stop_token& stop) {
  give_way(0);
  std::mutex mutex;
  std::condition_variable_any woken;
  std::unique_lock lock(mutex);
  const auto stopped = [&stop] { return stop.stop_requested(); };
  while (!woken.wait_for(lock, stop, std::chrono::nanoseconds(sync_period.ns), stopped)) (void)outbox_.sync();
}

void Session::publish_status(ArrivalTime now) {
  std::vector<std::uint8_t> payload;
  encode(to_status(report(), now), payload);
  outbox_.publish_now(configuration_.channels.bus(channel::mr_status), payload);
}

Report Session::report() {
  Report report;
  report.source = "live";
  report.tally = state_->tally;
  report.frames_dropped = frames_dropped_;
  report.agent_frames_dropped = agent_frames_dropped_;
  report.inputs_dropped = inbox_.dropped();
  report.scan_us = stages_.scan_us;
  report.scan_in_to_out_us = in_to_out_us_;
  report.frame_us = frame_us_;
  report.agent_frame_us = agent_frame_us_;
  report.physics_step_us = stages_.physics_step_us;
  report.physics_wait_us = stages_.physics_wait_us;
  report.log_seconds = report.wall_seconds = (last_ - started_).seconds();
  tell_completeness(outbox_, report);
  report.guard_fired = guard_.fired();
  note_what_images_lack(configuration_.robot, renderer_.fault(), report);
  if (agents_renderer_) note_what_images_lack(configuration_.robot, agents_renderer_->fault(), report);
  report.notes["priority"] = real_time_.note();
  if (configuration_.scenario.mapping)
    report.notes["mapping"] = views_ ? views_->note() : "none: no mapper was given";
  if (const std::string slam = slam_note(*state_); !slam.empty()) report.notes["slam"] = slam;
  return report;
}

}  // namespace

Result<std::optional<RobotDescription>> wait_for_robot(Bus& bus, const Scenario& scenario,
                                                       const ServeOptions& options) {
  const std::string name = ChannelMap(scenario).bus(channel::robot);
  if (const Status subscribed = bus.subscribe(name, 1); !subscribed) return subscribed.error();
  if (options.say) options.say("waiting for the robot description on " + name + " (or give --robot FILE)");
  while (!options.stop || !options.stop()) {
    Message message;
    const auto received = bus.receive(message, idle);
    if (!received) return received.error();
    if (!*received) continue;
    RobotMessage robot;
    if (const Status read = decode(message.channel, message.payload, robot); !read) return read.error();
    auto description = parse_robot_description(robot.yaml, name);
    if (!description) return description.error();
    return std::optional(std::move(*description));
  }
  return std::optional<RobotDescription>{};
}

Result<Report> serve(Bus& bus, const Configuration& configuration, const ServeOptions& options) {
  for (const std::string& input : configuration.channels.inputs()) {
    const InputKind kind = configuration.channels.kind(input);
    if (kind == InputKind::loop || kind == InputKind::robot || kind == InputKind::model)
      continue;  // the server's own word; read before the start
    const bool newest_only = kind == InputKind::teleop || kind == InputKind::camera;
    if (const Status subscribed = bus.subscribe(input, newest_only ? 1 : 64); !subscribed)
      return subscribed.error();
  }
  // On those of a simulated robot's sensors nobody else may speak: heard only to notice it.
  const SentMessages sensors(configuration);
  for (const std::string& own : sensors.channels()) {
    if (const Status subscribed = bus.subscribe(own, 64); !subscribed) return subscribed.error();
  }
  std::optional<LogWriter> log;
  if (!options.session.empty()) {
    auto created = LogWriter::create(options.session, options.overwrite);
    if (!created) return created.error();
    log = std::move(*created);
  }
  return Session(bus, configuration, options, std::move(log))();
}

}  // namespace parhelion
