// A live server from start to end. The public interface is server/runtime/loop.hpp.
#pragma once

#include <optional>
#include <string>
#include <thread>

#include "protocols/bus/log_file.hpp"
#include "server/runtime/guard.hpp"
#include "server/runtime/inbox.hpp"
#include "server/runtime/log_watch.hpp"
#include "server/runtime/loop.hpp"
#include "server/runtime/render_thread.hpp"
#include "server/runtime/view_source.hpp"
#include "server/tick/tick.hpp"

namespace parhelion::runtime {

/// One live session on one thread: inputs go through the tick, its outputs to the log and the bus. Rendering,
/// mapping and disk syncs run on their own threads.
class LiveSession : private tick::ScanSink {
 public:
  LiveSession(Bus& bus, const tick::Configuration& configuration, const ServeOptions& options,
              std::optional<LogWriter> log);

  /// Runs until stopped.
  Result<Report> operator()();

 private:
  std::vector<std::vector<std::unique_ptr<Guard>>> make_guards();
  Guards guards() const;
  Guard& guard_of(const Arrived& scan) { return *guards_[scan.robot][scan.sensor]; }
  Status start();
  std::string run_until_stopped();
  void end();
  void handle(Arrived arrived);
  void handle_scan(const Arrived& arrived);
  Receipt publish(std::uint64_t number, std::span<const std::uint8_t> mr_scan) override;
  bool is_stale_command(const Arrived& arrived) const;
  bool refuse_unwritable(const Message& message);
  void keep_robot_stopped(const std::string& robot);
  void report_robot_stops();
  void report_commanded(std::size_t robot);
  void repeat_stop();
  Duration until_step() const;
  bool step_is_due() const;
  void step_on_time();
  bool skip_late_steps(ArrivalTime now);
  void note_given_up();
  void refuse_late_commands(std::size_t max_count);
  void note_foreign_messages();
  void note_refused_messages();
  void note_refused_hosts();
  void send_frames();
  void take_answers();
  void take_models();
  void decide(LoopDecision::Kind kind, std::uint64_t count, ArrivalTime stamp);
  void decide_now(LoopDecision::Kind kind, std::uint64_t count);
  Message note(LoopDecision::Kind kind, std::uint64_t sequence);
  void housekeeping();
  void look_after_log(const std::stop_token& stop);
  void check_log();
  void report_lost_log();
  void publish_status(ArrivalTime now);
  Report report();

  const tick::Configuration& configuration_;
  const ServeOptions& options_;
  const RealTimeScope real_time_;  // before the threads that scans wait for: they inherit it
  SentMessages sent_;
  Outbox outbox_;
  const LogWatch log_watch_;
  std::vector<std::vector<std::unique_ptr<Guard>>> guards_;  // by robot and laser: a late one delays no other
  Inbox inbox_;
  RenderThread renderer_;
  std::optional<RenderThread> agents_renderer_;  // from the first image of an agent's camera on
  std::optional<ViewSource> views_;
  std::string refused_hosts_;  // so far
  std::unique_ptr<tick::State> state_;
  tick::Outputs outputs_;
  StageClock stages_;
  struct ScanInWork {
    const Arrived& arrived;
    std::optional<Receipt> receipt;  // none: MR_SCAN is not computed yet
    std::uint64_t number = 0;
  };
  std::optional<ScanInWork> scan_;
  ArrivalTime started_, last_;
  WallTime last_housekeeping_ = steady_now();
  tick::Percentiles frame_us_, agent_frame_us_;
  std::vector<tick::Percentiles> in_to_out_us_;  // by robot
  std::uint64_t frames_dropped_ = 0, agent_frames_dropped_ = 0;
  std::vector<bool> robot_stopped_;   // by robot: last value passed to robot_stop_held
  std::vector<RobotStop> commanded_;  // by robot: last value passed to ServeOptions::commanded
  bool log_lost_ = false;             // people were told
  std::jthread syncer_{[this](const std::stop_token& stop) { look_after_log(stop); }};
};

}  // namespace parhelion::runtime
