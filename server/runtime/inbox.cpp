#include "server/runtime/inbox.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "protocols/channel_map.hpp"
#include "protocols/codec.hpp"
#include "server/tick/emergency_stop.hpp"
#include "server/tick/instructor_input.hpp"

namespace parhelion::runtime {
namespace {

constexpr Duration kPoll = milliseconds(50);  // maximum delay until the thread ends

constexpr Duration kForeignAgain = seconds(60.0);  // continued publishing is not reported again before

constexpr int kMaxMessagesAtEnd =
    4096;  // limit for draining the bus, so that a continuous sender cannot prevent the end

bool drives_robot(tick::InputKind kind) {
  return kind == tick::InputKind::teleop || kind == tick::InputKind::joint_command;
}

}  // namespace

Inbox::Inbox(Bus& bus, const tick::Configuration& configuration, Guards guards, InboxLimits limits,
             const SentMessages* sent, std::shared_ptr<const SessionClock> clock)
    : bus_(bus),
      configuration_(configuration),
      guards_(std::move(guards)),
      limits_(limits),
      sent_(sent),
      queues_(guards_.size() + 1),
      commands_(limits_.commands, limits_.bytes),
      clock_(clock ? std::move(clock) : std::make_shared<const SessionClock>()),
      thread_([this] { run(); }) {}

Inbox::~Inbox() { close(); }

void Inbox::close() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

void Inbox::run() {
  while (!stop_) {
    Message message;
    auto received = bus_.receive(message, kPoll);
    if (!received) {
      const std::lock_guard lock(mutex_);
      fault_ = received.error().message;
      changed_.notify_all();
      return;
    }
    if (*received) push(std::move(message));
  }
  // Messages on the bus at the end are received, too.
  Message message;
  for (int i = 0; i < kMaxMessagesAtEnd; ++i) {
    const auto received = bus_.receive(message, Duration{0});
    if (!received || !*received) return;
    push(std::move(message));
  }
}

Inbox::Queue& Inbox::queue_of(std::string_view channel, std::size_t robot) {
  return is_robot_channel(channels_.canonical(channel)) ? queues_[robot] : queues_.back();
}

void Inbox::push(Message message) {
  Arrived arrived;
  arrived.received = steady_now();
  const tick::InputKind kind = channels_.kind(message.channel, nullptr, &arrived.robot, &arrived.sensor);
  if (kind == tick::InputKind::none) return note_foreign(message);
  // Messages that are not scans are not forwarded as one.
  if (kind == tick::InputKind::scan && has_form_of_scan(message.payload))
    arrived.ticket = guards_[arrived.robot][arrived.sensor]->watch(message.payload);
  arrived.message = std::move(message);
  {
    const std::lock_guard lock(mutex_);
    enqueue(kind, std::move(arrived));
  }
  changed_.notify_one();  // the loop, after the lock is released
}

/// An emergency stop, or its release, that precedes what waits; nullopt: no such message.
std::optional<EmergencyStopCommand> Inbox::first_stop(tick::InputKind kind, const Message& message) const {
  EmergencyStopCommand command;
  if (kind != tick::InputKind::emergency_stop || !decode(message.channel, message.payload, command) ||
      !tick::is_for_trainee(configuration_, command))
    return std::nullopt;
  return command;
}

bool Inbox::has_room(const EmergencyStopCommand& stop) const {
  if (stops_.size() < limits_.stops) return true;
  if (!stop.engaged) return false;
  for (auto last = stops_.rbegin(); last != stops_.rend(); ++last) {
    const std::string& robot = last->command.robot;
    if (last->command.engaged && (robot.empty() || robot == stop.robot)) return false;
    if (!last->command.engaged && (robot.empty() || stop.robot.empty() || robot == stop.robot)) return true;
  }
  return true;
}

void Inbox::enqueue(tick::InputKind kind, Arrived arrived) {
  if (auto stop = first_stop(kind, arrived.message))
    return enqueue_stop({std::move(arrived), std::move(*stop)});
  if (tick::is_command(kind)) return enqueue_command(std::move(arrived));
  Queue& queue = queue_of(arrived.message.channel, arrived.robot);
  if (!make_room(queue, kind, arrived)) return;
  Amount& amount = queue.amounts[kind];
  ++amount.count;
  amount.bytes += arrived.message.payload.size();
  queue.bytes += arrived.message.payload.size();
  queue.waiting.push_back(std::move(arrived));
}

void Inbox::enqueue_stop(Stop stop) {
  if (has_room(stop.command)) {
    stops_.push_back(std::move(stop));
  } else {
    ++dropped_;
  }
}

void Inbox::enqueue_command(Arrived arrived) {
  const std::uint64_t sender = arrived.message.sender;
  const std::size_t bytes = arrived.message.payload.size();
  for (const Arrived& displaced : commands_.push(sender, std::move(arrived), bytes))
    refuse_command(displaced.message);
}

void Inbox::note_foreign(const Message& message) {
  if (sent_ == nullptr) return;
  const auto channel = sent_->foreign(message.channel, message.payload);
  if (!channel) return;
  const std::lock_guard lock(mutex_);
  foreign_.insert(*channel);
}

/// False: the new input is dropped. A scan is kept whatever it displaces.
bool Inbox::make_room(Queue& queue, tick::InputKind kind, const Arrived& arrived) {
  const bool is_scan = kind == tick::InputKind::scan;
  if (!is_scan && queue.amounts[kind].count >= limits_.others) drop_oldest(queue, kind);
  const std::size_t size = arrived.message.payload.size();
  if (!is_scan && size > limits_.bytes) {
    ++dropped_;
    return false;
  }
  while (queue.bytes > 0 && queue.bytes + size > limits_.bytes) {
    const auto largest =
        std::max_element(queue.amounts.begin(), queue.amounts.end(),
                         [](const auto& a, const auto& b) { return a.second.bytes < b.second.bytes; });
    drop_oldest(queue, largest->first);
  }
  return true;
}

/// Of a kind that is in the queue.
void Inbox::drop_oldest(Queue& queue, tick::InputKind kind) {
  const auto oldest = std::find_if(queue.waiting.begin(), queue.waiting.end(), [&](const Arrived& waiting) {
    return channels_.kind(waiting.message.channel) == kind;
  });
  if (oldest->ticket != 0) guards_[oldest->robot][oldest->sensor]->give_up(oldest->ticket);
  if (kind == tick::InputKind::scan && oldest->ticket != 0) ++given_up_;
  forget(queue, *oldest);
  ++dropped_;
  queue.waiting.erase(oldest);
}

void Inbox::forget(Queue& queue, const Arrived& leaving) {
  const std::size_t bytes = leaving.message.payload.size();
  Amount& amount = queue.amounts[channels_.kind(leaving.message.channel)];
  --amount.count;
  amount.bytes -= bytes;
  queue.bytes -= bytes;
}

Arrived Inbox::pop(Queue& queue) {
  Arrived arrived = std::move(queue.waiting.front());
  forget(queue, arrived);
  queue.waiting.pop_front();
  return arrived;
}

/// An emergency stop never is.
bool Inbox::is_late_command(const Arrived& arrived) const {
  return channels_.kind(arrived.message.channel) == tick::InputKind::command &&
         steady_now() - std::max(arrived.received, *first_take_) > limits_.command_age;
}

/// The loop would refuse it, and would need a step for that.
bool Inbox::is_superseded(const Queue& queue, const Arrived& arrived) const {
  const tick::InputKind kind = channels_.kind(arrived.message.channel);
  if (!drives_robot(kind) || wall_now().ns - arrived.message.arrival.ns <= driving_timing::kMaxQueueAge.ns)
    return false;
  const auto newer = queue.amounts.find(kind);
  return newer != queue.amounts.end() && newer->second.count > 0;
}

/// All at once: each would otherwise wait for a turn.
void Inbox::refuse_late_commands() {
  const auto late = commands_.take_oldest([this](const Arrived& each) { return is_late_command(each); });
  for (const Arrived& each : late) refuse_command(each.message);
}

/// Without a request number there is nobody to reply to.
void Inbox::refuse_command(const Message& message) {
  ++dropped_;
  InstructorCommand command;
  (void)tick::read_command(channels_, message, command);  // of an unreadable one, what could be read
  if (const std::uint64_t request = request_of(command); request != 0)
    (void)refused_commands_.push(message.sender, request, 1);
}

/// A stop, but not twice in a row while others have inputs; else the oldest of the queue whose turn it is, of
/// those with inputs; nullopt: there is none.
std::optional<Arrived> Inbox::next() {
  const auto next_stop = [this] {
    Arrived arrived = std::move(stops_.front().arrived);
    stops_.pop_front();
    took_stop_ = true;
    return arrived;
  };
  if (!stops_.empty() && !took_stop_) return next_stop();
  took_stop_ = false;
  for (std::size_t i = 0; i <= queues_.size(); ++i) {
    const std::size_t turn = std::exchange(turn_, (turn_ + 1) % (queues_.size() + 1));
    if (turn == queues_.size()) {
      if (auto command = commands_.pop()) return command;
      continue;
    }
    while (!queues_[turn].waiting.empty()) {
      Arrived arrived = pop(queues_[turn]);
      if (!is_superseded(queues_[turn], arrived)) return arrived;
      ++dropped_;
    }
  }
  return stops_.empty() ? std::nullopt : std::optional(next_stop());
}

std::optional<Arrived> Inbox::take(WallTime deadline) {
  std::unique_lock lock(mutex_);
  if (!first_take_) first_take_ = steady_now();
  while (true) {
    refuse_late_commands();
    if (auto arrived = next()) {
      lock.unlock();
      arrived->age = Duration{wall_now().ns - arrived->message.arrival.ns};
      arrived->message.arrival = stamp();
      return arrived;
    }
    const Duration left = deadline - steady_now();
    if (left.ns <= 0 || !fault_.empty() || std::exchange(woken_, false)) return std::nullopt;
    changed_.wait_for(lock, std::chrono::nanoseconds(left.ns));
  }
}

void Inbox::wake() {
  {
    const std::lock_guard lock(mutex_);
    woken_ = true;
  }
  changed_.notify_one();
}

ArrivalTime Inbox::stamp() {
  // Microseconds, as stored in logs.
  last_ = std::max(ArrivalTime::from_utime(now().utime()), last_ + microseconds(1));
  return last_;
}

ArrivalTime Inbox::next_stamp() {
  last_ = last_ + microseconds(1);
  return last_;
}

std::uint64_t Inbox::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_ + bus_.dropped();
}

std::uint64_t Inbox::take_given_up() {
  const std::lock_guard lock(mutex_);
  return std::exchange(given_up_, 0);
}

std::vector<std::uint64_t> Inbox::take_refused_commands(std::size_t max_count) {
  const std::lock_guard lock(mutex_);
  std::vector<std::uint64_t> taken;
  while (taken.size() < max_count) {
    const auto request = refused_commands_.pop();
    if (!request) break;
    taken.push_back(*request);
  }
  return taken;
}

std::vector<std::int64_t> Inbox::take_foreign(WallTime now) {
  const std::lock_guard lock(mutex_);
  std::vector<std::int64_t> channels;
  for (const std::int64_t channel : std::exchange(foreign_, {})) {
    const auto taken = foreign_taken_.find(channel);
    if (taken != foreign_taken_.end() && now - taken->second < kForeignAgain) continue;
    foreign_taken_[channel] = now;
    channels.push_back(channel);
  }
  return channels;
}

std::string Inbox::fault() const {
  const std::lock_guard lock(mutex_);
  return fault_;
}

}  // namespace parhelion::runtime
