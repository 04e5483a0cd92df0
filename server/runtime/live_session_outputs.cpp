// Exchange with other threads, and messages about the session's state.
#include <condition_variable>
#include <mutex>

#include "server/runtime/live_session.hpp"
#include "server/tick/foreign_publisher.hpp"

namespace parhelion::runtime {
namespace {

constexpr int kAgentsNice = 15;  // agents' images: lower priority than the trainee's robot
constexpr Duration kWatchPeriod = milliseconds(250);
constexpr int kChecksPerSync = 4;  // a sync each second limits the loss at a power cut (promise 6)
constexpr Duration kStatusPeriod = seconds(1.0);

}  // namespace

void LiveSession::send_frames() {
  for (tick::Outputs::Frame& frame : outputs_.frames()) {
    const bool agents = !frame.agent.empty();
    if (agents && !agents_renderer_)
      agents_renderer_.emplace(
          configuration_.model, true, kAgentsNice, [this] { inbox_.wake(); }, options_.texture);
    const auto dropped = (agents ? *agents_renderer_ : renderer_).submit_newest(std::move(frame));
    if (!dropped) continue;
    ++(agents ? agent_frames_dropped_ : frames_dropped_);
    const Message decision = note(LoopDecision::Kind::frame_dropped, *dropped);
    outbox_.send(&decision, {}, last_);
  }
  outputs_.frames().clear();
}

void LiveSession::take_answers() {
  const auto take = [this](RenderThread& renderer, tick::Percentiles& latency_us) {
    while (auto done = renderer.take(false)) {
      tick::Outputs answer;
      tick::publish_frame(configuration_, *done, answer, state_->tally);
      latency_us.add(done->latency.microseconds());
      outbox_.send(nullptr, answer.entries(), last_);
    }
  };
  take(renderer_, frame_us_);
  if (agents_renderer_) take(*agents_renderer_, agent_frame_us_);
}

/// A finished model is an input: stamped, logged, and applied by replay.
void LiveSession::take_models() {
  while (auto ready = views_ ? views_->take() : std::nullopt) {
    last_ = inbox_.stamp();
    if (skip_late_steps(last_)) last_ = inbox_.stamp();
    Message message{configuration_.channels.bus(channel::kMrModel), last_, {}};
    encode(ready->message, message.payload);
    state_->site.prepared = std::move(ready->prepared);
    outputs_.clear();
    const WallTime begun = steady_now();
    tick::tick(configuration_, message, *state_, outputs_, stages_);
    outbox_.send(&message, outputs_.entries(), last_);
    views_->held_up(steady_now() - begun);
    send_frames();
  }
}

void LiveSession::housekeeping() {
  if (steady_now() - last_housekeeping_ < kStatusPeriod) return;
  last_housekeeping_ = steady_now();
  note_foreign_messages();
  note_refused_messages();
  note_refused_hosts();
  publish_status(last_);
}

/// Reports other publishers on our channels once, not each of their messages.
void LiveSession::note_foreign_messages() {
  for (const std::int64_t channel : inbox_.take_foreign(steady_now())) {
    if (channel == tick::status_channel_index() && options_.notify) options_.notify(tick::kOtherServerText);
    decide_now(LoopDecision::Kind::foreign_message, static_cast<std::uint64_t>(channel));
  }
}

/// Reports each kind of refused message once a channel.
void LiveSession::note_refused_messages() {
  if (options_.refused == nullptr) return;
  for (const RefusedMessages::First& first : options_.refused->take()) {
    if (options_.notify) {
      options_.notify("a message on " + first.channel + " was " + to_string(first.fault) +
                      (first.sender.empty() ? "" : " ('" + first.sender + "')") + ": refused");
    }
    const std::int64_t count = tick::refused_message_count(configuration_, first.fault, first.channel);
    decide_now(LoopDecision::Kind::refused_message, static_cast<std::uint64_t>(count));
  }
}

void LiveSession::note_refused_hosts() {
  if (options_.refused_hosts == nullptr) return;
  for (const std::string& host : options_.refused_hosts->take()) {
    refused_hosts_ += (refused_hosts_.empty() ? "" : ", ") + host;
    if (options_.notify) {
      options_.notify("messages of " + host +
                      " are refused: they are not signed (docs/security.md), and the scenario's 'hosts' does "
                      "not list this machine");
    }
  }
}

/// On its own thread: a slow disk delays no scan.
void LiveSession::look_after_log(const std::stop_token& stop) {
  lower_priority(0);
  std::mutex mutex;
  std::condition_variable_any woken;
  std::unique_lock lock(mutex);
  const auto stopped = [&stop] { return stop.stop_requested(); };
  for (int checks = 1; !woken.wait_for(lock, stop, std::chrono::nanoseconds(kWatchPeriod.ns), stopped);
       ++checks) {
    check_log();
    if (checks % kChecksPerSync == 0) (void)outbox_.sync();
  }
}

void LiveSession::check_log() {
  if (const Status there = log_watch_.check(); !there) outbox_.give_up_log(there.error().message);
}

/// Once and at once, while the session can still be repeated.
void LiveSession::report_lost_log() {
  if (log_lost_ || outbox_.complete()) return;
  log_lost_ = true;
  if (options_.notify) options_.notify("the session is incomplete: " + outbox_.log_error());
  publish_status(last_);
}

void LiveSession::publish_status(ArrivalTime now) {
  std::vector<std::uint8_t> payload;
  encode(to_status(report(), now), payload);
  outbox_.publish_now(configuration_.channels.bus(channel::kMrStatus), payload);
}

Report LiveSession::report() {
  Report report;
  report.source = "live";
  report.tally = state_->tally;
  report.frames_dropped = frames_dropped_;
  report.agent_frames_dropped = agent_frames_dropped_;
  report.inputs_dropped = inbox_.dropped();
  report.scan_us = stages_.scan_us;
  for (const tick::Percentiles& robot : in_to_out_us_) report.scan_in_to_out_us.add(robot);
  report.frame_us = frame_us_;
  report.agent_frame_us = agent_frame_us_;
  report.physics_step_us = stages_.physics_step_us;
  report.physics_wait_us = stages_.physics_wait_us;
  report.log_seconds = report.wall_seconds = (last_ - started_).seconds();
  report_completeness(outbox_, report);
  report_robots(state_->robots, stages_, report);
  auto laser = report.lasers.begin();
  for (std::size_t i = 0; i < guards_.size(); ++i) {
    std::uint64_t fired = guards_[i].front()->fired();
    for (std::size_t k = 1; k < guards_[i].size(); ++k)
      fired += (laser++)->guard_fired = guards_[i][k]->fired();
    report.guard_fired += fired;
    if (report.robots.empty()) continue;
    report.robots[i].guard_fired = fired;
    report.robots[i].scan_in_to_out_us = in_to_out_us_[i];
  }
  if (options_.refused != nullptr) report.messages_refused = options_.refused->count();
  note_what_images_lack(configuration_.robot, renderer_.fault(), report);
  if (agents_renderer_) note_what_images_lack(configuration_.robot, agents_renderer_->fault(), report);
  if (!refused_hosts_.empty()) report.notes["refused_hosts"] = refused_hosts_;
  if (options_.open_bus)
    report.notes["open_bus"] =
        "anyone in this network can move the robot: authentication is off (docs/security.md)";
  report.notes["priority"] = real_time_.note();
  if (configuration_.scenario.mapping)
    report.notes["mapping"] = views_ ? views_->note() : "none: no mapper was given";
  if (const std::string slam = tick::slam_note(state_->robots.front().sensors.get()); !slam.empty())
    report.notes["slam"] = slam;
  return report;
}

}  // namespace parhelion::runtime
