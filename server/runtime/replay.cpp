#include "server/runtime/replay.hpp"

#include <algorithm>
#include <filesystem>
#include <thread>
#include <utility>

#include "protocols/arrival_order.hpp"
#include "protocols/bus/log_file.hpp"
#include "protocols/site_texture.hpp"
#include "server/runtime/fixed_texture.hpp"
#include "server/runtime/preview.hpp"
#include "server/runtime/render_thread.hpp"
#include "server/runtime/session_state.hpp"
#include "server/tick/tick.hpp"

namespace parhelion::runtime {
namespace {

/// One pass over the log. MR_SCAN is published with the other outputs.
class Run : private tick::ScanSink {
 public:
  Run(const ReplayOptions& options, const Preview& preview, const tick::Configuration& configuration,
      std::shared_ptr<const SiteTexture> texture, Outbox& outbox)
      : options_(options),
        preview_(preview),
        configuration_(configuration),
        texture_(std::move(texture)),
        outbox_(outbox) {
    robots_.renderer.emplace(configuration.model, tick::simulates_trainee(configuration.scenario), 0, nullptr,
                             texture_);
  }

  Result<Report> operator()();

 private:
  /// A renderer and its pending frame, if its result is not written yet.
  struct RenderSlot {
    std::optional<RenderThread> renderer;
    bool busy = false;
  };

  /// If the guard fired first in the live server, MR_SCAN is again the raw scan.
  Receipt publish(std::uint64_t sequence, std::span<const std::uint8_t>) override {
    return {.sent = false, .raw = preview_.guarded_scans.contains(sequence)};
  }
  bool is_input(const Message& message) const;
  Status handle(Message message);
  ArrivalTime place_in_time(const Message& message);
  void skip_to(ArrivalTime arrival);
  void pace(ArrivalTime arrival);
  void render_frames();
  void write_frame(RenderSlot& slot);
  void take_stock();
  void publish_status();
  void finish(const LogReader& reader);

  const ReplayOptions& options_;
  const Preview& preview_;
  const tick::Configuration& configuration_;
  const std::shared_ptr<const SiteTexture> texture_;
  Outbox& outbox_;
  RenderSlot robots_, agents_;  // agents_: its renderer is created at the first image of an agent's camera
  std::unique_ptr<tick::State> state_;
  tick::Outputs outputs_, frame_outputs_;
  StageClock stages_{configuration_.robot_count()};
  Report report_;
  ArrivalTime first_, last_, last_status_;
  ArrivalOrder order_;
  WallTime begun_ = steady_now();
};

bool Run::is_input(const Message& message) const {
  return configuration_.channels.kind(message.channel) != tick::InputKind::none;
}

void Run::pace(ArrivalTime arrival) {
  if (options_.rate <= 0) return;
  const Duration due = seconds((arrival - first_).seconds() / options_.rate);
  const Duration ahead = due - (steady_now() - begun_);
  if (ahead.ns > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(ahead.ns));
}

/// After a long gap (a recording paused for an hour) the steps in between are skipped, with a record in the
/// session log.
ArrivalTime Run::place_in_time(const Message& message) {
  const bool is_loop_record = configuration_.channels.kind(message.channel) == tick::InputKind::loop;
  const auto placed = order_.place(message.arrival, is_loop_record);
  if (placed.verdict != ArrivalOrder::Verdict::own_stamp) ++report_.arrivals_corrected;
  if (placed.verdict == ArrivalOrder::Verdict::real_leap) skip_to(placed.arrival - microseconds(1));
  return placed.arrival;
}

void Run::skip_to(ArrivalTime arrival) {
  LoopDecision decision;
  decision.stamp = {arrival.ns};
  decision.kind = LoopDecision::Kind::steps_skipped;
  const std::uint64_t due = state_->simulation.steps_due(simulation_time(arrival));
  decision.count = static_cast<std::int64_t>(due) - (due > 0 ? 1 : 0);
  Message message{channel::kLoop, arrival, {}};
  encode(decision, message.payload);
  outputs_.clear();
  tick::tick(configuration_, message, *state_, outputs_, stages_);
  outbox_.send(&message, outputs_.entries(), arrival);
  render_frames();
}

Status Run::handle(Message message) {
  if (!state_) {
    // Physics starts with the server for a session, and with the first input for a bare log.
    first_ = preview_.session ? ArrivalTime{preview_.session->stamp.ns} : message.arrival;
    auto made = make_session_state(configuration_, first_, options_.threads);
    if (!made) return made.error();
    state_ = std::move(*made);
    tick::Outputs::Entry header{channel::kMrSession, {}};
    encode(tick::session_header(configuration_, {first_.ns}), header.payload);
    outbox_.send(nullptr, {&header, 1}, first_);
    last_ = first_ - microseconds(1);
    order_.begin_after(last_);
  }
  message.arrival = place_in_time(message);
  last_ = message.arrival;
  pace(last_);
  outputs_.clear();
  std::size_t robot = 0;
  (void)configuration_.channels.kind(message.channel, nullptr, &robot);
  stages_.begin(robot);
  tick::tick(configuration_, message, *state_, outputs_, stages_, *this);
  outbox_.send(&message, outputs_.entries(), message.arrival);
  render_frames();
  publish_status();
  if (options_.watch) options_.watch(configuration_, message, state_->robots[robot]);
  return {};
}

/// A replay waits for rendering: an image is rendered while the inputs up to the next image are handled, and
/// its result is written before that of the next. With one thread it waits at once, and writes at the same
/// place.
void Run::render_frames() {
  for (tick::Outputs::Frame& frame : outputs_.frames()) {
    const bool agents = !frame.agent.empty();
    RenderSlot& slot = agents ? agents_ : robots_;
    write_frame(slot);
    if (preview_.dropped_frames.contains(frame.sequence)) {
      ++(agents ? report_.agent_frames_dropped : report_.frames_dropped);
      continue;
    }
    if (!slot.renderer) slot.renderer.emplace(configuration_.model, true, 0, nullptr, texture_);
    slot.renderer->submit(std::move(frame));
    slot.busy = true;
    if (options_.threads == 1) slot.renderer->wait();
  }
}

void Run::write_frame(RenderSlot& slot) {
  if (!std::exchange(slot.busy, false)) return;
  const auto done = slot.renderer->take(true);
  if (!done) return;
  frame_outputs_.clear();
  tick::publish_frame(configuration_, *done, frame_outputs_, state_->tally);
  (done->agent.empty() ? report_.frame_us : report_.agent_frame_us).add(done->latency.microseconds());
  outbox_.send(nullptr, frame_outputs_.entries(), last_);
  if (options_.watch_camera && done->agent.empty() && !done->answer.image.bytes.empty())
    options_.watch_camera(done->answer.image);
}

void Run::take_stock() {
  report_.source = options_.log;
  report_.notes.insert(options_.notes.begin(), options_.notes.end());
  if (state_) {
    report_.tally = state_->tally;
    report_robots(state_->robots, stages_, report_);
    if (const std::string slam = tick::slam_note(state_->robots.front().sensors.get()); !slam.empty())
      report_.notes["slam"] = slam;
  }
  report_.scan_us = stages_.scan_us;
  report_.physics_step_us = stages_.physics_step_us;
  report_.physics_wait_us = stages_.physics_wait_us;
  report_.log_seconds = (last_ - first_).seconds();
  report_.wall_seconds = (steady_now() - begun_).seconds();
  report_completeness(outbox_, report_);
  for (const RenderSlot* slot : {&robots_, &agents_})
    if (slot->renderer) note_what_images_lack(configuration_.robot, slot->renderer->fault(), report_);
}

/// Once a second of log time; never in the session log, since the figures are measured.
void Run::publish_status() {
  if (options_.bus == nullptr || last_ - last_status_ < seconds(1.0)) return;
  last_status_ = last_;
  take_stock();
  std::vector<std::uint8_t> payload;
  encode(to_status(report_, last_), payload);
  outbox_.publish_now(configuration_.channels.bus(channel::kMrStatus), payload);
}

void Run::finish(const LogReader& reader) {
  if (state_) {
    outputs_.clear();
    tick::finish(configuration_, *state_, outputs_);
    outbox_.send(nullptr, outputs_.entries(), last_);
    render_frames();
  }
  for (RenderSlot* slot : {&robots_, &agents_}) write_frame(*slot);
  (void)outbox_.sync();
  take_stock();
  report_.log_damage_bytes = reader.skipped_bytes();
  report_.hash = outbox_.hashes();
  if (state_) report_.grades = grades_now(configuration_, state_->grading.get(), options_.session);
  if (!report_.grades.empty()) report_.grade = report_.grades.front();
}

Result<Report> Run::operator()() {
  auto reader = LogReader::open(options_.log);
  if (!reader) return reader.error();
  while (!options_.stop || !options_.stop()) {
    auto next = reader->next();
    if (!next) {
      report_.notes["log"] = next.error().message;
      continue;
    }
    if (!*next) break;
    if (!is_input(**next)) {
      // Outputs in a session log are not consumed, but their stamps advance the time.
      order_.see((*next)->arrival);
      continue;
    }
    if (const Status handled = handle(std::move(**next)); !handled) return handled.error();
    if (options_.progress) options_.progress({reader->offset(), reader->size(), (last_ - first_).seconds()});
  }
  finish(*reader);
  if (!state_)
    return Error{options_.log +
                 ": no input channel in it; expected at least SCAN (rename channels in the scenario)"};
  return report_;
}

/// The texture that was chosen, or the one beside the model of the scenario that replaces the session's.
Result<std::shared_ptr<const SiteTexture>> choose_texture(const ReplayOptions& options,
                                                          const std::string& map_id) {
  if (options.texture) {
    auto texture = load_site_texture(*options.texture);
    if (!texture) return texture.error();
    return std::make_shared<const SiteTexture>(std::move(*texture));
  }
  if (!options.scenario) return std::shared_ptr<const SiteTexture>();
  const auto scenario = load_scenario(*options.scenario);
  return scenario ? load_texture_of(scenario->model, map_id) : scenario.error();
}

}  // namespace

Result<Report> replay(const ReplayOptions& options) {
  std::error_code ignored;
  if (!options.session.empty() && std::filesystem::equivalent(options.log, options.session, ignored))
    return Error{options.session + ": is the log being replayed; choose another name for the session"};
  const auto preview = look_ahead(options.log);
  if (!preview) return preview.error();
  const auto configuration = choose_configuration(options, *preview);
  if (!configuration) return configuration.error();
  auto texture = choose_texture(options, configuration->model.map_id);
  if (!texture) return texture.error();
  std::optional<LogWriter> log;
  if (!options.session.empty()) {
    auto created = LogWriter::create(options.session, options.overwrite);
    if (!created) return created.error();
    log = std::move(*created);
  }
  Outbox outbox(options.bus, std::move(log));
  return Run(options, *preview, *configuration, without_objects(std::move(*texture), configuration->objects),
             outbox)();
}

}  // namespace parhelion::runtime
