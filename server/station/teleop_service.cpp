#include "server/station/teleop_service.hpp"

#include <algorithm>
#include <utility>

#include "protocols/codec.hpp"
#include "protocols/driving_timing.hpp"

namespace parhelion::station {
namespace {

constexpr const char* kBrowser = "browser";
constexpr const char* kEnded = "the session has ended";

bool outranks(Role one, Role other) {
  const auto instructs = [](Role role) { return role == Role::instructor || role == Role::admin; };
  return instructs(one) && !instructs(other);
}

}  // namespace

TeleopService::TeleopService(Bus& bus, TeleopOptions options) : bus_(bus), options_(std::move(options)) {
  for (const auto& [robot, by] : options_.active_stops) {
    stopped_by_[robot] = by;
    stop_requests_[robot].number = next_request();
  }
}

TeleopService::~TeleopService() {
  const std::lock_guard lock(mutex_);
  for (auto& [id, teleop_client] : clients_) release_control(*teleop_client, false, "the base station ends");
}

void TeleopService::end_session() {
  const std::lock_guard lock(mutex_);
  ended_ = true;
  for (auto& [id, teleop_client] : clients_) {
    if (teleop_client->robot().empty()) continue;
    release_control(*teleop_client, false, kEnded);
    refuse(*teleop_client, Error{kEnded});
  }
}

SocketHandler TeleopService::socket() {
  return {[this](std::shared_ptr<WebClient> client) { opened(std::move(client)); },
          [this](WebClient& client, std::string_view bytes, bool binary) { received(client, bytes, binary); },
          [this](WebClient& client) { closed(client); }};
}

void TeleopService::opened(std::shared_ptr<WebClient> client) {
  const std::lock_guard lock(mutex_);
  const std::uint64_t id = client->id();
  TeleopClient& teleop_client =
      *(clients_[id] = std::make_unique<TeleopClient>(bus_, std::move(client), options_.now()));
  teleop_client.set_robots(robots_);
  for (const auto& [other, driver] : clients_) {
    if (!driver->robot().empty() && is_for(teleop_client, driver->robot()))
      teleop_client.send(driven_text(driver->robot(), driver->who(), false));
  }
  for (const auto& [robot, by] : stopped_by_)
    if (is_for(teleop_client, robot)) teleop_client.send(estop_text(robot, by, true));
  // Last, when it is known which robots are free.
  teleop_client.send(robots_text(robots_for(teleop_client)));
}

bool TeleopService::is_for(const TeleopClient& teleop_client, const std::string& robot) const {
  if (teleop_client.client().who().role != Role::trainee || is_trainees(robot)) return true;
  const TeleopRobot* known = find(robot);
  return known != nullptr && known->for_trainees;
}

std::vector<TeleopRobot> TeleopService::robots_for(const TeleopClient& teleop_client) const {
  std::vector<TeleopRobot> robots = robots_;
  std::erase_if(robots, [&](const TeleopRobot& robot) { return !is_for(teleop_client, robot.driven.name); });
  return robots;
}

void TeleopService::closed(WebClient& client) {
  const std::lock_guard lock(mutex_);
  const auto found = clients_.find(client.id());
  if (found == clients_.end()) return;
  release_control(*found->second, true, "the connection to the page was lost");
  clients_.erase(found);
}

void TeleopService::received(WebClient& client, std::string_view bytes, bool binary) {
  const std::lock_guard lock(mutex_);
  const auto found = clients_.find(client.id());
  if (found == clients_.end()) return;
  TeleopClient& teleop_client = *found->second;
  teleop_client.note_message(options_.now());
  if (teleop_client.is_too_fast(options_.now())) {
    release_control(teleop_client, true, "the page sends too many messages");
    return client.close(1008, "too many messages: at most 300 a second");
  }
  const auto request =
      binary ? Result<TeleopRequest>(Error{"expected text, not binary"}) : read_teleop_request(bytes);
  if (request) return refuse(teleop_client, act(teleop_client, *request));
  const Status halted = teleop_client.halt(now());
  refuse(teleop_client, halted ? Status(request.error()) : halted);
  if (!teleop_client.is_too_faulty()) return;
  release_control(teleop_client, true, "the page sends invalid messages");
  client.close(1008, "too many invalid messages");
}

Status TeleopService::act(TeleopClient& teleop_client, const TeleopRequest& request) {
  using Kind = TeleopRequest::Kind;
  switch (request.kind) {
    case Kind::drive:
      return drive(teleop_client, request.robot);
    case Kind::twist:
    case Kind::joints:
      return move(teleop_client, request);
    case Kind::release:
      return teleop_client.release(now());
    case Kind::stop:
      return stop_locked(request.robot.empty() ? teleop_client.robot() : request.robot, teleop_client.who());
    case Kind::ping:
      reply_to_ping(teleop_client, request);
      return {};
  }
  return {};
}

void TeleopService::reply_to_ping(TeleopClient& teleop_client, const TeleopRequest& request) {
  const TeleopInstant instant = now();
  teleop_client.clock().age(request.stamp.at, instant.steady);
  const Duration ago = instant.stamp - SensorTime::from_utime(request.pong_us.value_or(0));
  if (request.pong_us) teleop_client.clock().handle_pong(instant.steady - ago, request.pong_received_at);
  teleop_client.send(pong_text(request.stamp.at, instant.stamp.utime()));
}

Status TeleopService::move(TeleopClient& teleop_client, const TeleopRequest& request) {
  if (const auto stop = stopped_by_.find(teleop_client.robot()); stop != stopped_by_.end()) {
    if (Status halted = teleop_client.halt(now()); !halted) return halted;
    return Error{"emergency stop by " + stop->second + " is active; an instructor must release it"};
  }
  const auto moved = request.kind == TeleopRequest::Kind::joints
                         ? teleop_client.move_joints(request, now())
                         : teleop_client.move(request.stamp, request.twist, now());
  if (!moved) return moved.error();
  if (*moved) teleop_client.send(sent_text(request.stamp));
  return {};
}

Result<TeleopClient*> TeleopService::client_to_replace(const TeleopClient& teleop_client,
                                                       const std::string& robot) const {
  for (const auto& [name, other] : other_consoles_) {
    if (other.robot == robot)
      return Error{"robot '" + robot + "' is driven by '" + name + "' from another console"};
  }
  for (const auto& [id, other] : clients_) {
    if (other.get() == &teleop_client || other->robot() != robot) continue;
    const auto& mine = teleop_client.client().who();
    if (other->who() == mine.name || outranks(mine.role, other->client().who().role)) return other.get();
    return Error{"robot '" + robot + "' is driven by '" + other->who() + "'"};
  }
  return static_cast<TeleopClient*>(nullptr);
}

Status TeleopService::drive(TeleopClient& teleop_client, const std::string& robot) {
  if (ended_) return Error{kEnded};
  const TeleopRobot* wanted = find(robot);
  if (wanted == nullptr || !is_for(teleop_client, robot)) {
    std::string known;
    for (const TeleopRobot& each : robots_for(teleop_client))
      known += (known.empty() ? "" : ", ") + each.driven.name;
    return Error{"no robot '" + robot + "'; there " + (known.empty() ? "is none yet" : "are " + known)};
  }
  if (!wanted->why_not.empty()) return Error{"robot '" + robot + "' cannot be driven: " + wanted->why_not};
  const auto replaced = client_to_replace(teleop_client, robot);
  if (!replaced) return replaced.error();
  // One operator drives one robot, even from two pages.
  for (auto& [id, other] : clients_) {
    if (other.get() == &teleop_client || (other.get() != *replaced && other->who() != teleop_client.who()))
      continue;
    if (other->robot().empty()) continue;
    refuse(*other, Error{"'" + teleop_client.who() + "' drives from another page now: stopped"});
    release_control(*other, false, "");
  }
  const std::string before = teleop_client.robot();
  if (Status driving = teleop_client.drive(*wanted, now()); !driving) return driving;
  if (!before.empty() && before != robot) send_driver(before);
  send_driver(robot);
  if (before != robot) audit(teleop_client.who(), "drives " + robot);
  return {};
}

void TeleopService::release_control(TeleopClient& teleop_client, bool lost, const std::string& why) {
  const std::string robot = teleop_client.robot();
  if (robot.empty()) return;
  refuse(teleop_client, teleop_client.release_control(lost, why, now()));
  audit(teleop_client.who(), "drives " + robot + " no more" + (why.empty() ? "" : ": " + why));
  send_driver(robot);
}

void TeleopService::refuse(TeleopClient& teleop_client, const Status& why) {
  if (!why) teleop_client.send(refused_text(why.error().message, teleop_client.must_rearm()));
}

const TeleopRobot* TeleopService::find(const std::string& robot) const {
  const auto found = std::find_if(robots_.begin(), robots_.end(),
                                  [&](const TeleopRobot& each) { return each.driven.name == robot; });
  return found == robots_.end() ? nullptr : &*found;
}

void TeleopService::set_robots(std::vector<TeleopRobot> robots) {
  const std::lock_guard lock(mutex_);
  robots_ = std::move(robots);
  for (auto& [id, teleop_client] : clients_) {
    const std::string driven = teleop_client->robot();
    if (!driven.empty() && find(driven) == nullptr) {
      release_control(*teleop_client, false, "it was removed");
      refuse(*teleop_client, Error{"robot '" + driven + "' was removed"});
    }
    teleop_client->set_robots(robots_);
    teleop_client->send(robots_text(robots_for(*teleop_client)));
  }
}

void TeleopService::handle(const OperatorStatus& status) {
  const std::lock_guard lock(mutex_);
  if (status.text == kBrowser) return;  // our own messages come back, too
  if (status.state == OperatorStatus::State::drives) {
    other_consoles_[status.name] = {status.robot, options_.now()};
  } else {
    other_consoles_.erase(status.name);
  }
}

void TeleopService::turn() {
  const std::lock_guard lock(mutex_);
  const WallTime steady = options_.now();
  std::erase_if(other_consoles_, [&](const auto& each) {
    return steady - each.second.last_status >= driving_timing::kConsoleSilence;
  });
  for (auto& [id, teleop_client] : clients_) {
    const std::string robot = teleop_client->robot();
    refuse(*teleop_client, teleop_client->watch(now()));
    if (teleop_client->robot() == robot) continue;
    audit(teleop_client->who(), "drives " + robot + " no more: no message from the page");
    send_driver(robot, true);
  }
  repeat_stop_requests(steady);
}

std::vector<Driving> TeleopService::driving() const {
  const std::lock_guard lock(mutex_);
  std::vector<Driving> all;
  for (const auto& [id, teleop_client] : clients_) {
    if (!teleop_client->robot().empty()) all.push_back({teleop_client->robot(), teleop_client->who()});
  }
  return all;
}

void TeleopService::send_about(const std::string& robot, const std::string& text) {
  for (auto& [id, teleop_client] : clients_)
    if (is_for(*teleop_client, robot)) teleop_client->send(text);
}

void TeleopService::send_driver(const std::string& robot, bool silent) {
  const TeleopClient* driver = nullptr;
  for (const auto& [id, teleop_client] : clients_) {
    if (teleop_client->robot() == robot) driver = teleop_client.get();
  }
  for (auto& [id, teleop_client] : clients_) {
    if (!is_for(*teleop_client, robot)) continue;
    teleop_client->send(
        driven_text(robot, driver == nullptr ? "" : driver->who(), teleop_client.get() == driver, silent));
  }
}

void TeleopService::audit(const std::string& who, const std::string& what) const {
  if (options_.audit) options_.audit(who, what);
}

}  // namespace parhelion::station
