#include "server/station/instructor_service.hpp"

#include <algorithm>
#include <utility>

#include "protocols/channels.hpp"
#include "protocols/driving_timing.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/station/saved_scenario.hpp"

namespace parhelion::station {
namespace {

using Kind = ClientMessage::Kind;

constexpr Duration kPatience = seconds(3.0);                    // timeout of the server's reply
constexpr Duration kMaxDelay = driving_timing::kMaxCommandAge;  // of a message, by the page's `seen`
constexpr double kMessagesPerSecond = 50, kAtOnce = 100;
constexpr std::size_t kMaxUnanswered = 1000;

/// Commands that the server replies to.
bool is_command(Kind kind) {
  return kind == Kind::agent || kind == Kind::script || kind == Kind::fault || kind == Kind::start ||
         kind == Kind::report;
}

/// Lines that are kept beside the session's log.
bool is_note(Kind kind) { return kind == Kind::chat || kind == Kind::mark; }

/// Messages that are stored or sent to everybody cost more of a page's rate limit.
double cost(Kind kind) { return kind == Kind::chat || kind == Kind::report ? 25 : 1; }
constexpr double kSpared = 20;  // part of the rate limit reserved for cheaper messages

/// For the audit, and for people: "spawn person_1".
std::string summary(const ClientMessage& message) {
  if (is_command(message.kind))
    return std::string(action_of(message.command)) + " " + subject_of(message.command);
  std::string text = to_string(message.kind);
  if (message.kind == Kind::rate || message.kind == Kind::seek) text += " " + std::to_string(message.value);
  return message.name.empty() ? text : text + " " + message.name;
}

bool is_instructor(Role role) { return role == Role::instructor || role == Role::admin; }

}  // namespace

bool may(Role role, ClientMessage::Kind kind, bool recorded) {
  const bool instructs = is_instructor(role);
  switch (kind) {
    case Kind::subscribe:
      return true;
    case Kind::report:
    case Kind::chat:
    case Kind::estop:
    case Kind::estop_release:  // by a trainee: see execute()
      return role != Role::observer;
    case Kind::pause:
    case Kind::resume:
    case Kind::step:
    case Kind::rate:
    case Kind::seek:
      return instructs || (recorded && role != Role::observer);
    case Kind::agent:
    case Kind::script:
    case Kind::fault:
    case Kind::start:
    case Kind::end:
    case Kind::save:
    case Kind::mark:
      return instructs;
  }
  return false;
}

InstructorService::InstructorService(Bus& bus, StateFeed& feed, SessionNotes notes, InstructorOptions options)
    : bus_(bus),
      feed_(feed),
      notes_(std::move(notes)),
      options_(std::move(options)),
      next_request_(static_cast<std::uint64_t>(runtime::wall_now().ns)) {}

void InstructorService::answer(WebClient& client, std::uint64_t request, const Status& done,
                               const std::string& text) const {
  if (request == 0 && done.ok()) return;  // no reply requested
  client.send(shared_text(reply_json(request, done, text)), false);
}

void InstructorService::note(const Identity& who, const std::string& remote, const std::string& what,
                             const Status& done) const {
  if (options_.audit) options_.audit(who, remote, what, done.ok() ? "done" : done.error().message);
}

Status InstructorService::check_rate(Subscriber& subscriber, WallTime now) const {
  if (subscriber.allowance_at.ns != 0)
    subscriber.allowance = std::min(
        kAtOnce, subscriber.allowance + kMessagesPerSecond * (now - subscriber.allowance_at).seconds());
  subscriber.allowance_at = now;
  if (subscriber.allowance < 1) return Error{"more than 50 messages a second"};
  subscriber.allowance -= 1;
  return {};
}

/// A connection that hangs delivers later what its sender was told had failed. Nothing moves in a recording,
/// but a line that is written down twice stands twice there, too.
Status InstructorService::check_delay(const ClientMessage& message, WallTime now) const {
  if (!message.seen || (feed_.recorded() && !is_note(message.kind))) return {};
  const double clock = Duration{now.ns}.seconds();
  constexpr double kAhead = 1;  // s, of a clock that has not been there yet
  if (*message.seen > clock + kAhead)
    return Error{"sent before the server was started again; nothing was changed. Repeat it"};
  if (clock - *message.seen <= kMaxDelay.seconds()) return {};
  return Error{"delayed by the connection for more than " + std::to_string(kMaxDelay.ns / 1'000'000'000) +
               " s; nothing was changed. Repeat it"};
}

void InstructorService::receive(WebClient& client, std::string_view text, WallTime now) {
  Subscriber* subscriber = feed_.subscribers().find(client.id());
  if (subscriber == nullptr) return;
  if (const Status rate = check_rate(*subscriber, now); !rate) {
    note(client.who(), client.remote(), "messages", rate);
    return client.close(1008, rate.error().message);
  }
  std::uint64_t request = 0;
  const auto message = read_client_message(text, request);
  if (!message) {
    note(client.who(), client.remote(), "unreadable message", Status(message.error()));
    return answer(client, request, message.error(), {});
  }
  if (!may(client.who().role, message->kind, feed_.recorded())) {
    const Status refused =
        Error{std::string(role_name(client.who().role)) + "s may not do this: " + to_string(message->kind)};
    note(client.who(), client.remote(), summary(*message), refused);
    return answer(client, request, refused, {});
  }
  if (const Status prompt = check_delay(*message, now); !prompt) {
    note(client.who(), client.remote(), summary(*message), prompt);
    return answer(client, request, prompt, {});
  }
  if (message->kind == Kind::subscribe) return feed_.subscribe(client.id(), message->subscription);
  if (const double more = cost(message->kind) - 1; more == 0 || subscriber->allowance >= more + kSpared) {
    subscriber->allowance -= more;
  } else {
    const Status refused =
        Error{std::string("too many messages: at most two a second of '") + to_string(message->kind) + "'"};
    note(client.who(), client.remote(), to_string(message->kind), refused);
    return answer(client, request, refused, {});
  }
  if (is_command(message->kind)) {
    const Status sent = send(client, *message, now);
    if (sent) return;  // the server will reply
    note(client.who(), client.remote(), summary(*message), sent);
    return answer(client, request, sent, {});
  }
  const auto done = execute(client, *message);
  const Status status = done ? Status() : Status(done.error());
  if (message->kind != Kind::chat) note(client.who(), client.remote(), summary(*message), status);
  answer(client, request, status, done ? *done : std::string());
}

Status InstructorService::send(WebClient& client, ClientMessage message, WallTime now) {
  if (feed_.recorded()) return Error{"this is a recording: it accepts no commands"};
  if (asked_.size() >= kMaxUnanswered) return Error{"the server does not reply"};
  const std::string what = summary(message);
  set_request(message.command, {runtime::wall_now().ns}, ++next_request_);
  // A trainee's report is about the robot that the page follows, and uses the trainee's names.
  const Subscriber* subscriber = feed_.subscribers().find(client.id());
  if (auto* report = std::get_if<ObjectReport>(&message.command); report != nullptr && subscriber != nullptr)
    report->object = feed_.audience().view_of(*subscriber).entity_of(report->object);
  encode(message.command, payload_);
  const std::string channel = feed_.configuration().channels.bus(
      channel_of(message.command), subscriber != nullptr ? subscriber->robot : 0);
  if (Status sent = bus_.publish(channel, payload_); !sent) return sent;
  asked_[next_request_] = {client.id(), message.request, client.who(), client.remote(), what, now};
  return {};
}

void InstructorService::handle(const Event& event) {
  if (event.kind != EventKind::command_accepted && event.kind != EventKind::command_refused) return;
  const auto asked = asked_.find(event.request);
  if (event.request == 0 || asked == asked_.end()) return;
  const Status done = event.kind == EventKind::command_accepted ? Status() : Status(Error{event.text});
  note(asked->second.who, asked->second.remote, asked->second.what, done);
  if (Subscriber* subscriber = feed_.subscribers().find(asked->second.client))
    answer(*subscriber->client, asked->second.request, done, event.text);
  asked_.erase(asked);
}

void InstructorService::look(WallTime now) {
  for (auto asked = asked_.begin(); asked != asked_.end();) {
    if (now - asked->second.at < kPatience) {
      ++asked;
      continue;
    }
    const Status silent = Error{"the server has not replied within 3 s"};
    note(asked->second.who, asked->second.remote, asked->second.what, silent);
    if (Subscriber* subscriber = feed_.subscribers().find(asked->second.client))
      answer(*subscriber->client, asked->second.request, silent, {});
    asked = asked_.erase(asked);
  }
}

Result<std::string> InstructorService::execute(WebClient& client, const ClientMessage& message) {
  const auto stop = [&](bool on) -> Result<std::string> {
    if (!options_.emergency_stop) return Error{"no emergency stop here: this session has no robot to stop"};
    if (!on && !is_instructor(client.who().role) && !tick::simulates_trainee(feed_.configuration().scenario))
      return Error{std::string(role_name(client.who().role)) +
                   "s may not release the emergency stop of a real robot; an instructor must"};
    const Status done = options_.emergency_stop(on, message.name, client.who());
    if (!done) return done.error();
    return std::string(on ? "stopped" : "released");
  };
  switch (message.kind) {
    case Kind::save:
      return save(message);
    case Kind::chat:
      return send_chat(client, message);
    case Kind::mark:
      return mark(client, message);
    case Kind::estop:
    case Kind::estop_release:
      return stop(message.kind == Kind::estop);
    default:
      return control(message);
  }
}

Result<std::string> InstructorService::control(const ClientMessage& message) {
  const SessionControls& controls = options_.controls;
  const auto done = [](const auto& able, auto... value) -> Result<std::string> {
    if (!able) return Error{"not available in this session"};
    if (const Status status = able(value...); !status) return status.error();
    return std::string();
  };
  const bool real = !feed_.recorded() && !tick::simulates_trainee(feed_.configuration().scenario);
  if (real && message.kind != Kind::end)
    return Error{"a real robot cannot be paused: freeze the agents, or stop the robot"};
  switch (message.kind) {
    case Kind::pause:
    case Kind::resume:
      return done(controls.pause, message.kind == Kind::pause);
    case Kind::step:
      return done(controls.step);
    case Kind::rate:
      return done(controls.rate, message.value);
    case Kind::seek:
      return done(controls.seek, message.value);
    default:
      return done(controls.end);
  }
}

Result<std::string> InstructorService::save(const ClientMessage& message) {
  const auto saved = save_scenario(feed_, options_.scenarios, message.name);
  if (!saved) return saved.error();
  std::string text = saved->path + ": " + std::to_string(saved->agents) + " agents";
  for (std::size_t i = 0; i < saved->left_out.size(); ++i)
    text += (i == 0 ? "; left out, as only their names are known: " : ", ") + saved->left_out[i];
  return text;
}

Result<std::string> InstructorService::send_chat(WebClient& client, const ClientMessage& message) {
  const ChatLine line{.t = feed_.t(feed_.now()),
                      .from = client.who().name,
                      .role = client.who().role,
                      .to_role = message.role,
                      .to_person = message.name,
                      .text = message.text};
  const Status kept = notes_.add(line, runtime::wall_now());
  const SharedText text = shared_text(chat_json(line));
  for (const Subscriber& subscriber : feed_.subscribers().all()) {
    if (is_for(line, subscriber.client->who())) subscriber.client->send(text, false);
  }
  if (!kept) return Error{"sent, but not stored: " + kept.error().message};
  return std::string();
}

Result<std::string> InstructorService::mark(const WebClient& client, const ClientMessage& message) {
  const MarkLine line{feed_.t(feed_.now()), client.who().name, message.text};
  const Status kept = notes_.add(line, runtime::wall_now());
  feed_.audience().send([&](const View& view) { return view.trainee ? std::string() : mark_json(line); });
  if (!kept) return Error{"marked, but not stored: " + kept.error().message};
  return std::string();
}

void InstructorService::greet(WebClient& client) const {
  for (const ChatLine& line : notes_.chat()) {
    if (is_for(line, client.who())) client.send(shared_text(chat_json(line)), false);
  }
  if (is_trainee(client.who())) return;  // marks are for the debriefing
  for (const MarkLine& line : notes_.marks()) client.send(shared_text(mark_json(line)), false);
}

}  // namespace parhelion::station
