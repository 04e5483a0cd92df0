// Received inputs, each with a strictly increasing arrival stamp of the session clock.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/driving_timing.hpp"
#include "protocols/instructor_command.hpp"
#include "server/runtime/guard.hpp"
#include "server/runtime/sent_messages.hpp"
#include "server/runtime/session_clock.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::runtime {

struct Arrived {
  Message message;
  tick::InputKind kind = tick::InputKind::none;
  std::size_t robot = 0;     ///< whose input it is; 0 for those of the session
  std::size_t sensor = 0;    ///< of that robot: the laser of a scan, the camera of an image
  std::uint64_t ticket = 0;  ///< of the laser's guard, for scans
  WallTime received;         ///< steady clock, at receipt
  Duration in_kernel;        ///< before its receipt, by the wall clock: the kernel's stamps are of that
  Duration age;              ///< since its receipt by the kernel, when it was taken
};

using Guards = std::vector<std::vector<Guard*>>;

/// Limits of a queue. Bytes are those of payloads, and sizeof(Arrived) for each input.
struct InboxLimits {
  std::size_t others = 256;  ///< of each kind but scans and commands; beyond it the oldest is dropped
  std::size_t other_bytes = std::size_t{64} << 20;  ///< of these kinds together
  /// Of scans and commands: enough for more than half an hour of ten scans of 361 beams a second.
  std::size_t bytes = std::size_t{64} << 20;
  std::size_t commands = 1000;  ///< of instructors, waiting: a scenario's whole crowd
  std::size_t stops = 256;  ///< emergency stops of trainees' robots, and their releases; as many of agents
  /// Longest wait of an instructor's command or release of an emergency stop, in the kernel and here, from
  /// the first call of take() on. `inject` and pages wait longer for a reply: what they report as failed must
  /// not happen later.
  Duration command_age = driving_timing::kMaxCommandAge;
};

/// Inputs are received on a thread, so that the guard gets each scan even while the loop is delayed; the loop
/// takes them. Each robot has a queue, and so has the session, with the instructors' commands; they take
/// turns, so that a robot that sends too much delays itself, and a loop that cannot keep up with a robot's
/// inputs still executes commands. Emergency stops of trainees' robots, and their releases, precede all else,
/// in the order in which they came; while many wait, each second input is another one. The stop of an agent
/// waits in turn, behind what makes the agent: the session's inputs stay in the order in which they came.
///
/// The queues are bounded, and dropped inputs are counted. Of what a newer one replaces (odometry, poses,
/// IMU, joints, images, TELEOP) each kind has its own limit: a source that sends too much costs no other kind
/// an input. Beyond `other_bytes` the oldest of the kind with the most bytes is dropped. Beyond `bytes` the
/// oldest scan is given up to the guard, which publishes it raw; if no scan is queued, the newest command is
/// refused, before it was acknowledged. When `commands` wait, the newest command of the sender that has the
/// most is refused, so that a flood costs no other sender a command; the same holds of the stops of agents
/// and their releases. Of the other emergency stops beyond `stops` a release is refused, and a stop is
/// dropped that only repeats what the last ones that wait say: no robot stays free. A command that has waited
/// longer than `command_age` is refused, and so is a release, with all copies of it that follow; a stop is
/// never too old. Setting the wall clock makes nothing older that has been received.
class Inbox {
 public:
  /// `sent`: detects messages of other publishers, for take_foreign(). `clock`: the session's; none: creates
  /// its own. `guards`: by robot, one for each of its lasers. `configuration` must outlive this.
  Inbox(Bus& bus, const tick::Configuration& configuration, Guards guards, InboxLimits limits = {},
        const SentMessages* sent = nullptr, std::shared_ptr<const SessionClock> clock = nullptr);
  ~Inbox();

  /// Reads the remaining messages from the bus, then stops receiving; queued inputs can still be taken.
  void close();

  /// The next input, stamped; nullopt: none arrived until `deadline` (steady clock), or wake() was called.
  std::optional<Arrived> take(WallTime deadline);
  /// Ends the wait of the current or next take(), so that the loop can do other work.
  void wake();
  /// The session clock's time.
  ArrivalTime now() const { return clock_->now(); }
  /// A stamp for a decision of the loop, or for a timer tick: later than all stamps before it.
  ArrivalTime stamp();
  std::uint64_t dropped() const;
  /// A stamp right after the last one, for decisions that belong together: no time passes between them.
  ArrivalTime next_stamp();
  /// Scans given up to the guard since the last call: they are missing in the session log.
  std::uint64_t take_given_up();
  static constexpr std::size_t kMaxRefusals = 2000;
  /// Request numbers of instructors' commands that were refused and not yet taken, the oldest first. At most
  /// kMaxRefusals are kept, and some more releases; further ones are only counted as dropped.
  std::vector<std::uint64_t> take_refused_commands(std::size_t max_count = kMaxRefusals);
  /// Channels (see SentMessages::foreign()) with messages of other publishers since the last call, ascending;
  /// each at most once a minute. Messages do not identify their sender.
  std::vector<std::int64_t> take_foreign(WallTime now);
  std::string fault() const;  ///< why receiving has ended, or empty

 private:
  void run();
  void push(Message message);
  void note_foreign(const Message& message);
  struct Stop {
    Arrived arrived;
    EmergencyStopCommand command;
  };
  static constexpr std::size_t kMaxRefusedReleases = 256;
  static constexpr std::size_t kKinds = static_cast<std::size_t>(tick::InputKind::operators) + 1;
  struct Load {
    std::size_t count = 0, bytes = 0;
  };
  struct Crowd {
    std::size_t count = 0;
    std::map<std::uint64_t, std::size_t> of;  // by sender, see Message::sender
  };
  struct Queue {
    std::deque<Stop> stops;  // before all that waits
    std::deque<Arrived> waiting;
    std::array<Load, kKinds> others;         // by kind, see InboxLimits::others
    std::size_t other_bytes = 0, bytes = 0;  // as in InboxLimits
    Crowd commands, agent_stops;             // of those that wait
  };
  Queue& queue_of(const Arrived& arrived);
  Queue* next_queue();
  std::optional<EmergencyStopCommand> first_stop(const Arrived& arrived) const;
  bool has_room(const Queue& queue, const EmergencyStopCommand& stop) const;
  void enqueue(Queue& queue, Arrived arrived);
  void enqueue_stop(Queue& queue, Stop stop);
  bool make_room(Queue& queue, const Arrived& arrived);
  void make_room_for_other(Queue& queue, const Arrived& arrived);
  bool make_room_among(Queue& queue, const Crowd& crowd, const Arrived& arrived);
  Arrived pop(Queue& queue);
  bool is_late(const Arrived& arrived) const;
  void refuse_late_commands(Queue& queue);
  void refuse(const Arrived& arrived);
  void refuse_command(const Message& message);
  bool is_refused_release(std::uint64_t request) const;
  void drop(Queue& queue, std::deque<Arrived>::iterator waiting);
  static void forget(Queue& queue, const Arrived& leaving);
  static Crowd* crowd_of(Queue& queue, tick::InputKind kind);
  static std::deque<Arrived>::iterator oldest(Queue& queue, tick::InputKind kind);

  Bus& bus_;
  const tick::Configuration& configuration_;
  const tick::ChannelMap& channels_ = configuration_.channels;
  const Guards guards_;
  const InboxLimits limits_;
  const SentMessages* sent_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Queue> queues_;  // by robot; the last is the session's
  std::optional<WallTime> first_take_;
  std::size_t turn_ = 0;    // index of the queue that is next
  bool took_stop_ = false;  // the last input was one
  std::uint64_t dropped_ = 0, given_up_ = 0;
  std::vector<std::uint64_t> refused_commands_;
  // Request numbers, the newest last: of trainees' robots, and of agents, which must not displace them.
  std::deque<std::uint64_t> refused_releases_, refused_agent_releases_;
  std::set<std::int64_t> foreign_;
  std::map<std::int64_t, WallTime> foreign_taken_;  // last report of each channel
  std::string fault_;
  bool woken_ = false;
  const std::shared_ptr<const SessionClock> clock_;
  ArrivalTime last_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace parhelion::runtime
