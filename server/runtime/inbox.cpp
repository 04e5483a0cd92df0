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

/// Then the oldest of a kind is dropped.
bool is_replaced_by_newer(tick::InputKind kind) {
  return kind != tick::InputKind::scan && kind != tick::InputKind::command &&
         kind != tick::InputKind::emergency_stop;
}

std::size_t bytes_of(const Arrived& arrived) { return sizeof(Arrived) + arrived.message.payload.size(); }

/// The request number of a release of an emergency stop; nullopt: another message.
std::optional<std::uint64_t> release_in(const Arrived& arrived) {
  EmergencyStopCommand command;
  if (arrived.kind != tick::InputKind::emergency_stop ||
      !decode(arrived.message.channel, arrived.message.payload, command) || command.engaged)
    return std::nullopt;
  return command.request;
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

Inbox::Queue& Inbox::queue_of(const Arrived& arrived) {
  const bool of_agent =
      arrived.kind == tick::InputKind::agent_teleop || arrived.kind == tick::InputKind::agent_joint_command;
  const bool robots = !of_agent && is_robot_channel(channels_.canonical(arrived.message.channel));
  return robots ? queues_[arrived.robot] : queues_.back();
}

void Inbox::push(Message message) {
  Arrived arrived;
  arrived.received = steady_now();
  arrived.in_kernel = Duration{std::max<std::int64_t>(0, wall_now().ns - message.arrival.ns)};
  arrived.kind = channels_.kind(message.channel, nullptr, &arrived.robot, &arrived.sensor);
  if (arrived.kind == tick::InputKind::none) return note_foreign(message);
  // Messages that are not scans are not forwarded as one.
  if (arrived.kind == tick::InputKind::scan && has_form_of_scan(message.payload))
    arrived.ticket = guards_[arrived.robot][arrived.sensor]->watch(message.payload);
  arrived.message = std::move(message);
  {
    const std::lock_guard lock(mutex_);
    Queue& queue = queue_of(arrived);
    enqueue(queue, std::move(arrived));
  }
  changed_.notify_one();  // the loop, after the lock is released
}

/// An emergency stop, or its release, that precedes what waits; nullopt: no such message.
std::optional<EmergencyStopCommand> Inbox::first_stop(const Arrived& arrived) const {
  EmergencyStopCommand command;
  if (arrived.kind != tick::InputKind::emergency_stop ||
      !decode(arrived.message.channel, arrived.message.payload, command) ||
      !tick::is_for_trainee(configuration_, command))
    return std::nullopt;
  return command;
}

bool Inbox::has_room(const Queue& queue, const EmergencyStopCommand& stop) const {
  if (queue.stops.size() < limits_.stops) return true;
  if (!stop.engaged) return false;
  for (auto last = queue.stops.rbegin(); last != queue.stops.rend(); ++last) {
    const std::string& robot = last->command.robot;
    if (last->command.engaged && (robot.empty() || robot == stop.robot)) return false;
    if (!last->command.engaged && (robot.empty() || stop.robot.empty() || robot == stop.robot)) return true;
  }
  return true;
}

void Inbox::enqueue(Queue& queue, Arrived arrived) {
  if (auto stop = first_stop(arrived)) return enqueue_stop(queue, {std::move(arrived), std::move(*stop)});
  if (!make_room(queue, arrived)) return;
  if (is_replaced_by_newer(arrived.kind)) {
    Load& load = queue.others[static_cast<std::size_t>(arrived.kind)];
    ++load.count;
    load.bytes += bytes_of(arrived);
    queue.other_bytes += bytes_of(arrived);
  } else {
    queue.bytes += bytes_of(arrived);
  }
  if (Crowd* crowd = crowd_of(queue, arrived.kind)) {
    ++crowd->count;
    ++crowd->of[arrived.message.sender];
  }
  queue.waiting.push_back(std::move(arrived));
}

/// A stop that is dropped only repeats one that waits.
void Inbox::enqueue_stop(Queue& queue, Stop stop) {
  if (has_room(queue, stop.command)) {
    queue.stops.push_back(std::move(stop));
  } else if (stop.command.engaged) {
    ++dropped_;
  } else {
    refuse(stop.arrived);
  }
}

void Inbox::note_foreign(const Message& message) {
  if (sent_ == nullptr) return;
  const auto channel = sent_->foreign(message.channel, message.payload);
  if (!channel) return;
  const std::lock_guard lock(mutex_);
  foreign_.insert(*channel);
}

/// False: the new input is dropped.
bool Inbox::make_room(Queue& queue, const Arrived& arrived) {
  if (is_replaced_by_newer(arrived.kind)) {
    make_room_for_other(queue, arrived);
    return true;
  }
  while (queue.bytes > 0 && queue.bytes + bytes_of(arrived) > limits_.bytes) {
    const auto scan = oldest(queue, tick::InputKind::scan);
    if (scan == queue.waiting.end() && arrived.kind == tick::InputKind::scan)
      break;  // only commands left: a scan is kept regardless
    if (scan == queue.waiting.end()) {
      refuse(arrived);
      return false;
    }
    if (scan->ticket != 0) {
      guards_[scan->robot][scan->sensor]->give_up(scan->ticket);
      ++given_up_;
    }
    drop(queue, scan);
  }
  const Crowd* crowd = crowd_of(queue, arrived.kind);
  const std::size_t limit = crowd == &queue.commands ? limits_.commands : limits_.stops;
  return crowd == nullptr || crowd->count < limit || make_room_among(queue, *crowd, arrived);
}

/// Inputs that are limited in number, fairly to each sender; null: no such kind.
Inbox::Crowd* Inbox::crowd_of(Queue& queue, tick::InputKind kind) {
  if (kind == tick::InputKind::command) return &queue.commands;
  return kind == tick::InputKind::emergency_stop ? &queue.agent_stops : nullptr;
}

void Inbox::make_room_for_other(Queue& queue, const Arrived& arrived) {
  if (queue.others[static_cast<std::size_t>(arrived.kind)].count >= limits_.others)
    drop(queue, oldest(queue, arrived.kind));
  while (queue.other_bytes > 0 && queue.other_bytes + bytes_of(arrived) > limits_.other_bytes) {
    const auto largest = std::max_element(queue.others.begin(), queue.others.end(),
                                          [](const Load& a, const Load& b) { return a.bytes < b.bytes; });
    drop(queue, oldest(queue, static_cast<tick::InputKind>(largest - queue.others.begin())));
  }
}

/// Of the sender that has the most, the newest leaves; of stops and releases a release, while there is one.
/// False: that is the new one.
bool Inbox::make_room_among(Queue& queue, const Crowd& crowd, const Arrived& arrived) {
  const auto longest = std::max_element(crowd.of.begin(), crowd.of.end(),
                                        [](const auto& a, const auto& b) { return a.second < b.second; });
  const auto own = crowd.of.find(arrived.message.sender);
  const std::size_t with_new = 1 + (own == crowd.of.end() ? 0 : own->second);
  const bool is_own = longest == crowd.of.end() || with_new >= longest->second;
  const std::uint64_t sender = is_own ? arrived.message.sender : longest->first;
  const auto newest = [&](bool of_releases) {
    return std::find_if(queue.waiting.rbegin(), queue.waiting.rend(), [&](const Arrived& waiting) {
      return waiting.message.sender == sender && waiting.kind == arrived.kind &&
             (!of_releases || release_in(waiting));
    });
  };
  auto leaving = queue.waiting.rend();
  if (!is_own || !release_in(arrived)) leaving = newest(true);
  if (!is_own && leaving == queue.waiting.rend()) leaving = newest(false);
  if (leaving == queue.waiting.rend()) {
    refuse(arrived);
    return false;
  }
  refuse(*leaving);
  forget(queue, *leaving);
  queue.waiting.erase(std::next(leaving).base());
  return true;
}

std::deque<Arrived>::iterator Inbox::oldest(Queue& queue, tick::InputKind kind) {
  return std::find_if(queue.waiting.begin(), queue.waiting.end(),
                      [&](const Arrived& waiting) { return waiting.kind == kind; });
}

void Inbox::drop(Queue& queue, std::deque<Arrived>::iterator waiting) {
  forget(queue, *waiting);
  ++dropped_;
  queue.waiting.erase(waiting);
}

void Inbox::forget(Queue& queue, const Arrived& leaving) {
  if (is_replaced_by_newer(leaving.kind)) {
    Load& load = queue.others[static_cast<std::size_t>(leaving.kind)];
    --load.count;
    load.bytes -= bytes_of(leaving);
    queue.other_bytes -= bytes_of(leaving);
  } else {
    queue.bytes -= bytes_of(leaving);
  }
  Crowd* crowd = crowd_of(queue, leaving.kind);
  if (crowd == nullptr) return;
  --crowd->count;
  const auto sender = crowd->of.find(leaving.message.sender);
  if (--sender->second == 0) crowd->of.erase(sender);
}

Arrived Inbox::pop(Queue& queue) {
  Arrived arrived;
  took_stop_ = !queue.stops.empty();
  if (took_stop_) {
    arrived = std::move(queue.stops.front().arrived);
    queue.stops.pop_front();
  } else {
    arrived = std::move(queue.waiting.front());
    forget(queue, arrived);
    queue.waiting.pop_front();
  }
  arrived.age = arrived.in_kernel + (steady_now() - arrived.received);
  return arrived;
}

/// A release would free a robot that its sender believes to be stopped: a copy of one that was refused is
/// late, too. A paused process receives late what the kernel has kept for it.
bool Inbox::is_late(const Arrived& arrived) const {
  const auto release = release_in(arrived);
  if (arrived.kind != tick::InputKind::command && !release) return false;
  if (release && is_refused_release(*release)) return true;
  const WallTime now = steady_now();
  return std::min(arrived.in_kernel + (now - arrived.received), now - *first_take_) > limits_.command_age;
}

/// All of the oldest at once: with one a turn the replies would come after nobody waits for them any more.
void Inbox::refuse_late_commands(Queue& queue) {
  while (!queue.stops.empty() && is_late(queue.stops.front().arrived)) {
    refuse(queue.stops.front().arrived);
    queue.stops.pop_front();
  }
  while (!queue.waiting.empty() && is_late(queue.waiting.front())) {
    refuse(queue.waiting.front());
    forget(queue, queue.waiting.front());
    queue.waiting.pop_front();
  }
}

/// Without a request number there is nobody to reply to.
void Inbox::refuse_command(const Message& message) {
  ++dropped_;
  InstructorCommand command;
  (void)tick::read_command(channels_, message, command);  // of an unreadable one, what could be read
  const std::uint64_t request = request_of(command);
  if (request != 0 && refused_commands_.size() < kMaxRefusals) refused_commands_.push_back(request);
}

/// One reply is enough for all copies of a release, and no flood of refused commands displaces it.
void Inbox::refuse(const Arrived& arrived) {
  const auto release = release_in(arrived);
  if (!release) return refuse_command(arrived.message);
  ++dropped_;
  if (*release == 0 || is_refused_release(*release)) return;
  std::deque<std::uint64_t>& refused = first_stop(arrived) ? refused_releases_ : refused_agent_releases_;
  refused.push_back(*release);
  if (refused.size() > kMaxRefusedReleases) refused.pop_front();
  if (refused_commands_.size() < kMaxRefusals + kMaxRefusedReleases) refused_commands_.push_back(*release);
}

bool Inbox::is_refused_release(std::uint64_t request) const {
  const auto is_in = [request](const std::deque<std::uint64_t>& refused) {
    return std::find(refused.begin(), refused.end(), request) != refused.end();
  };
  return is_in(refused_releases_) || is_in(refused_agent_releases_);
}

/// The session's for a stop, but not twice in a row while others have inputs; else the one whose turn it is,
/// of those with inputs; nullptr: there is none.
Inbox::Queue* Inbox::next_queue() {
  Queue& session = queues_.back();
  const bool stops = !session.stops.empty();
  if (stops && !took_stop_) return &session;
  for (std::size_t i = 0; i < queues_.size(); ++i) {
    Queue& queue = queues_[turn_];
    turn_ = (turn_ + 1) % queues_.size();
    if (!queue.waiting.empty() && !(stops && &queue == &session)) return &queue;
  }
  return stops ? &session : nullptr;
}

std::optional<Arrived> Inbox::take(WallTime deadline) {
  std::unique_lock lock(mutex_);
  if (!first_take_) first_take_ = steady_now();
  while (true) {
    refuse_late_commands(queues_.back());
    Queue* queue = nullptr;
    while ((queue = next_queue()) == nullptr) {
      const Duration left = deadline - steady_now();
      if (left.ns <= 0 || !fault_.empty() || std::exchange(woken_, false)) return std::nullopt;
      changed_.wait_for(lock, std::chrono::nanoseconds(left.ns));
    }
    Arrived arrived = pop(*queue);
    if (is_late(arrived)) {  // while this waited for another input
      refuse(arrived);
      continue;
    }
    lock.unlock();
    arrived.message.arrival = stamp();
    return arrived;
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
  const auto end =
      refused_commands_.begin() + static_cast<std::ptrdiff_t>(std::min(max_count, refused_commands_.size()));
  std::vector<std::uint64_t> taken(refused_commands_.begin(), end);
  refused_commands_.erase(refused_commands_.begin(), end);
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
