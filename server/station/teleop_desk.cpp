#include "server/station/teleop_desk.hpp"

#include <algorithm>
#include <utility>

#include "protocols/codec.hpp"
#include "protocols/driving_timing.hpp"

namespace parhelion::station {
namespace {

constexpr const char* browser = "browser";

bool outranks(Role one, Role other) {
  const auto instructs = [](Role role) { return role == Role::instructor || role == Role::admin; };
  return instructs(one) && !instructs(other);
}

}  // namespace

TeleopDesk::TeleopDesk(Bus& bus, TeleopOptions options) : bus_(bus), options_(std::move(options)) {
  for (const auto& [robot, by] : options_.held) {
    held_[robot] = by;
    orders_[robot].request = next_request();
  }
}

TeleopDesk::~TeleopDesk() {
  const std::lock_guard lock(mutex_);
  for (auto& [id, page] : pages_) let_go(*page, false, "the base station ends");
}

SocketHandler TeleopDesk::socket() {
  return {[this](std::shared_ptr<WebClient> client) { opened(std::move(client)); },
          [this](WebClient& client, std::string_view bytes, bool binary) { received(client, bytes, binary); },
          [this](WebClient& client) { closed(client); }};
}

void TeleopDesk::opened(std::shared_ptr<WebClient> client) {
  const std::lock_guard lock(mutex_);
  const std::uint64_t id = client->id();
  TeleopPage& page = *(pages_[id] = std::make_unique<TeleopPage>(bus_, std::move(client), options_.now()));
  page.set_robots(robots_);
  for (const auto& [other, driver] : pages_) {
    if (!driver->robot().empty()) page.tell(driven_text(driver->robot(), driver->who(), false));
  }
  for (const auto& [robot, by] : held_) page.tell(estop_text(robot, by, true));
  page.tell(robots_text(robots_));  // last, when it is known which robots are free
}

void TeleopDesk::closed(WebClient& client) {
  const std::lock_guard lock(mutex_);
  const auto found = pages_.find(client.id());
  if (found == pages_.end()) return;
  let_go(*found->second, true, "the connection to the page was lost");
  pages_.erase(found);
}

void TeleopDesk::received(WebClient& client, std::string_view bytes, bool binary) {
  const std::lock_guard lock(mutex_);
  const auto found = pages_.find(client.id());
  if (found == pages_.end()) return;
  TeleopPage& page = *found->second;
  page.heard(options_.now());
  if (page.is_too_fast(options_.now())) {
    let_go(page, true, "the page sends too many messages");
    return client.close(1008, "too many messages: at most 300 a second");
  }
  const auto request =
      binary ? Result<TeleopRequest>(Error{"expected text, not binary"}) : read_teleop_request(bytes);
  if (request) return refuse(page, act(page, *request));
  const Status halted = page.halt(now());
  refuse(page, halted ? Status(request.error()) : halted);
  if (!page.is_too_faulty()) return;
  let_go(page, true, "the page sends invalid messages");
  client.close(1008, "too many invalid messages");
}

Status TeleopDesk::act(TeleopPage& page, const TeleopRequest& request) {
  using Kind = TeleopRequest::Kind;
  switch (request.kind) {
    case Kind::drive:
      return drive(page, request.robot);
    case Kind::twist:
    case Kind::joints:
      return move(page, request);
    case Kind::release:
      return page.release(now());
    case Kind::stop:
      return hold(request.robot.empty() ? page.robot() : request.robot, page.who());
    case Kind::ping:
      answer_ping(page, request);
      return {};
  }
  return {};
}

void TeleopDesk::answer_ping(TeleopPage& page, const TeleopRequest& request) {
  const TeleopInstant instant = now();
  page.clock().age(request.stamp.at, instant.steady);
  const Duration ago = instant.stamp - SensorTime::from_utime(request.heard_us.value_or(0));
  if (request.heard_us) page.clock().heard(instant.steady - ago, request.heard_at);
  page.tell(pong_text(request.stamp.at, instant.stamp.utime()));
}

Status TeleopDesk::move(TeleopPage& page, const TeleopRequest& request) {
  if (const auto stop = held_.find(page.robot()); stop != held_.end()) {
    if (Status halted = page.halt(now()); !halted) return halted;
    return Error{"emergency stop by " + stop->second + ": the instructor resets it"};
  }
  const auto moved = request.kind == TeleopRequest::Kind::joints
                         ? page.move_joints(request, now())
                         : page.move(request.stamp, request.twist, now());
  if (!moved) return moved.error();
  if (*moved) page.tell(sent_text(request.stamp));
  return {};
}

Result<TeleopPage*> TeleopDesk::page_to_replace(const TeleopPage& page, const std::string& robot) const {
  for (const auto& [name, other] : foreign_) {
    if (other.robot == robot)
      return Error{"robot '" + robot + "' is driven by '" + name + "' from another console"};
  }
  for (const auto& [id, other] : pages_) {
    if (other.get() == &page || other->robot() != robot) continue;
    const auto& mine = const_cast<TeleopPage&>(page).client().who();
    if (other->who() == mine.name || outranks(mine.role, other->client().who().role)) return other.get();
    return Error{"robot '" + robot + "' is driven by '" + other->who() + "'"};
  }
  return static_cast<TeleopPage*>(nullptr);
}

Status TeleopDesk::drive(TeleopPage& page, const std::string& robot) {
  const TeleopRobot* wanted = find(robot);
  if (wanted == nullptr) {
    std::string known;
    for (const TeleopRobot& each : robots_) known += (known.empty() ? "" : ", ") + each.driven.name;
    return Error{"no robot '" + robot + "'; there " + (known.empty() ? "is none yet" : "are " + known)};
  }
  if (!wanted->why_not.empty()) return Error{"robot '" + robot + "' cannot be driven: " + wanted->why_not};
  const auto replaced = page_to_replace(page, robot);
  if (!replaced) return replaced.error();
  // One operator drives one robot, even from two pages.
  for (auto& [id, other] : pages_) {
    if (other.get() == &page || (other.get() != *replaced && other->who() != page.who())) continue;
    if (other->robot().empty()) continue;
    refuse(*other, Error{"'" + page.who() + "' drives from another page now: stopped"});
    let_go(*other, false, "");
  }
  const std::string before = page.robot();
  if (Status driving = page.drive(*wanted, now()); !driving) return driving;
  if (!before.empty() && before != robot) tell_driven(before);
  tell_driven(robot);
  if (before != robot) audit(page.who(), "drives " + robot);
  return {};
}

void TeleopDesk::let_go(TeleopPage& page, bool lost, const std::string& why) {
  const std::string robot = page.robot();
  if (robot.empty()) return;
  refuse(page, page.let_go(lost, why, now()));
  audit(page.who(), "drives " + robot + " no more" + (why.empty() ? "" : ": " + why));
  tell_driven(robot);
}

void TeleopDesk::refuse(TeleopPage& page, const Status& why) {
  if (!why) page.tell(refused_text(why.error().message, page.must_rearm()));
}

const TeleopRobot* TeleopDesk::find(const std::string& robot) const {
  const auto found = std::find_if(robots_.begin(), robots_.end(),
                                  [&](const TeleopRobot& each) { return each.driven.name == robot; });
  return found == robots_.end() ? nullptr : &*found;
}

void TeleopDesk::set_robots(std::vector<TeleopRobot> robots) {
  const std::lock_guard lock(mutex_);
  robots_ = std::move(robots);
  for (auto& [id, page] : pages_) {
    const std::string driven = page->robot();
    if (!driven.empty() && find(driven) == nullptr) {
      let_go(*page, false, "it was removed");
      refuse(*page, Error{"robot '" + driven + "' was removed"});
    }
    page->set_robots(robots_);
  }
  tell_all(robots_text(robots_));
}

void TeleopDesk::hear(const OperatorWord& word) {
  const std::lock_guard lock(mutex_);
  if (word.text == browser) return;  // our own messages come back, too
  if (word.state == OperatorWord::State::drives) {
    foreign_[word.name] = {word.robot, options_.now()};
  } else {
    foreign_.erase(word.name);
  }
}

void TeleopDesk::turn() {
  const std::lock_guard lock(mutex_);
  const WallTime steady = options_.now();
  std::erase_if(foreign_, [&](const auto& each) {
    return steady - each.second.heard >= driving_timing::console_silence;
  });
  for (auto& [id, page] : pages_) {
    const std::string robot = page->robot();
    refuse(*page, page->watch(now()));
    if (page->robot() == robot) continue;
    audit(page->who(), "drives " + robot + " no more: no message from the page");
    tell_driven(robot, true);
  }
  repeat_orders(steady);
}

std::vector<Driving> TeleopDesk::driving() const {
  const std::lock_guard lock(mutex_);
  std::vector<Driving> all;
  for (const auto& [id, page] : pages_) {
    if (!page->robot().empty()) all.push_back({page->robot(), page->who()});
  }
  return all;
}

void TeleopDesk::tell_all(const std::string& text) {
  for (auto& [id, page] : pages_) page->tell(text);
}

void TeleopDesk::tell_driven(const std::string& robot, bool silent) {
  const TeleopPage* driver = nullptr;
  for (const auto& [id, page] : pages_) {
    if (page->robot() == robot) driver = page.get();
  }
  for (auto& [id, page] : pages_)
    page->tell(driven_text(robot, driver == nullptr ? "" : driver->who(), page.get() == driver, silent));
}

void TeleopDesk::audit(const std::string& who, const std::string& what) const {
  if (options_.audit) options_.audit(who, what);
}

}  // namespace parhelion::station
