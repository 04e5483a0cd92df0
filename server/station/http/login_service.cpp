#include "server/station/http/login_service.hpp"

#include <cmath>

#include "server/station/http/account_messages.hpp"
#include "server/station/http/password.hpp"
#include "server/station/http/request_checks.hpp"
#include "server/station/http/token.hpp"

namespace parhelion::station {
namespace {

constexpr int kMaxPerLink = 99;  // people of one link who get different names

HttpResponse nothing_more() { return {.status = 204}; }

/// A form of another site can post text, but not this content type.
bool is_json(const HttpRequest& request) { return request.content_type.rfind("application/json", 0) == 0; }

HttpResponse not_json() { return refusal(415, "expected application/json"); }

std::string joined(const std::vector<std::string>& items) {
  std::string all;
  for (const std::string& item : items) all += (all.empty() ? "" : ",") + item;
  return all;
}

}  // namespace

Result<std::unique_ptr<LoginService>> LoginService::open(Accounts& accounts, Audit& audit,
                                                         LoginOptions options) {
  std::unique_ptr<LoginService> service(new LoginService(accounts, audit, std::move(options)));
  service->restore_sessions();
  // An unknown name takes as long as a wrong password.
  Result<std::string> hash = hash_password(random_token());
  if (!hash) return hash.error();
  service->nobody_hash_ = *std::move(hash);
  if (accounts.empty()) service->setup_token_ = random_token();
  return service;
}

LoginService::LoginService(Accounts& accounts, Audit& audit, LoginOptions options)
    : accounts_(accounts),
      audit_(audit),
      limits_(options.limits),
      steady_(options.clocks.steady),
      sessions_(options.limits),
      session_file_(std::move(options.session_file), options.limits, sessions_, accounts,
                    std::move(options.clocks)) {}

void LoginService::restore_sessions() {
  const auto restored = session_file_.restore();
  if (restored && *restored == 0) return;
  if (!restored) restore_fault_ = restored.error().message;
  audit_.record({"", "", "restore log-ins", restored ? "done" : "refused",
                 restored ? std::to_string(*restored) : restore_fault_});
}

void LoginService::serve(HttpServer& server) {
  cookie_name_ = server.cookie_name();
  encrypted_ = server.encrypted();
  const Access admin = Access::only({Role::admin});
  server.on("GET", "/api/v1/me", Access::everyone(), [](const HttpRequest& request) {
    if (!request.who) return refusal(401, "not logged in");
    return HttpResponse{.status = 200,
                        .body = "{\"name\":" + json_text(request.who->name) +
                                ",\"role\":" + json_text(role_name(request.who->role)) + "}"};
  });
  server.on_late("POST", "/api/v1/login", Access::everyone(),
                 [this](const HttpRequest& request, const Answer& answer) { log_in(request, answer); });
  server.on_late("POST", "/api/v1/setup", Access::everyone(),
                 [this](const HttpRequest& request, const Answer& answer) { set_up(request, answer); });
  server.on_late(
      "POST", "/api/v1/password", Access::logged_in(),
      [this](const HttpRequest& request, const Answer& answer) { change_password(request, answer); });
  server.on_late("POST", "/api/v1/logout", Access::logged_in(),
                 [this](const HttpRequest& request, const Answer& answer) { log_out(request, answer); });
  server.on_late("GET", "/enter", Access::everyone(),
                 [this](const HttpRequest& request, const Answer& answer) { enter(request, answer); });
  server.on("GET", "/api/v1/accounts", admin, [this](const HttpRequest&) {
    std::vector<std::string> entries;
    for (const Identity& who : accounts_.list()) {
      entries.push_back("{\"name\":" + json_text(who.name) + ",\"role\":" + json_text(role_name(who.role)) +
                        "}");
    }
    return HttpResponse{.status = 200, .body = "{\"accounts\":[" + joined(entries) + "]}"};
  });
  server.on_late("POST", "/api/v1/accounts", admin, [this](const HttpRequest& request, const Answer& answer) {
    change_account(request, answer);
  });
  server.on_late(
      "DELETE", "/api/v1/accounts", admin,
      [this](const HttpRequest& request, const Answer& answer) { remove_account(request, answer); });
  server.on("GET", "/api/v1/audit", admin, [this](const HttpRequest&) {
    return HttpResponse{.status = 200, .body = "{\"entries\":[" + joined(audit_.newest(500)) + "]}"};
  });
}

std::optional<Identity> LoginService::identify(const std::string& session) {
  return sessions_.find(session, steady_());
}

std::string LoginService::make_link(Identity who) {
  std::string token = random_token();
  const std::lock_guard lock(mutex_);
  links_[token_digest(token)] = std::move(who);
  return token;
}

void LoginService::log_in(const HttpRequest& request, const Answer& answer) {
  if (!is_json(request)) return answer(not_json());
  const Result<LoginMessage> message = parse_login(request.body);
  if (!message) return answer(refusal(400, message.error().message));
  if (!may_try(request, message->name, answer)) return;
  later(request, answer, [this, request, answer, given = *message] {
    const std::string hash = accounts_.hash(given.name);
    const bool right = password_matches(hash.empty() ? nobody_hash_ : hash, given.password);
    const std::optional<Identity> who = accounts_.find(given.name);
    if (!right || hash.empty() || !who) {
      record(request, "log in as " + given.name, "refused", "wrong name or password");
      return answer(refusal(401, "wrong name or password"));
    }
    {
      const std::lock_guard lock(mutex_);
      guard_.succeeded(network_of(request.remote), given.name);
    }
    answer_when_stored(answer, begin_session(request, *who));
  });
}

void LoginService::set_up(const HttpRequest& request, const Answer& answer) {
  if (!is_json(request)) return answer(not_json());
  const Result<SetupMessage> message = parse_setup(request.body);
  if (!message) return answer(refusal(400, message.error().message));
  if (!may_try(request, "the first account", answer)) return;
  if (!accounts_.empty() || token_digest(message->token) != token_digest(setup_token_)) {
    record(request, "make the first account", "refused", "not with this link");
    return answer(refusal(
        403,
        "this link has been used, or it is from an earlier start; see the link that the server printed"));
  }
  for (const Status& fine : {check_account_name(message->name), check_password(message->password)}) {
    if (!fine) return answer(refusal(400, fine.error().message));
  }
  later(request, answer, [this, request, answer, given = *message] {
    Result<std::string> hash = hash_password(given.password);
    const Status made = hash ? accounts_.put_first(given.name, *std::move(hash)) : Status(hash.error());
    record(request, "make the first account, " + given.name, made ? "done" : "refused",
           made ? "" : made.error().message);
    if (!made) return answer(refusal(409, made.error().message));
    answer_when_stored(answer, begin_session(request, {given.name, Role::admin}));
  });
}

/// Access to an open page does not give access to the account.
void LoginService::change_password(const HttpRequest& request, const Answer& answer) {
  if (!is_json(request)) return answer(not_json());
  const Result<PasswordMessage> message = parse_password(request.body);
  if (!message) return answer(refusal(400, message.error().message));
  if (const Status fine = check_password(message->new_password); !fine)
    return answer(refusal(400, fine.error().message));
  const std::string name = request.who->name;
  if (accounts_.hash(name).empty())
    return answer(refusal(403, "you are logged in by a link: there is no password to change"));
  if (!may_try(request, name, answer)) return;
  later(request, answer, [this, request, answer, name, given = *message] {
    if (!password_matches(accounts_.hash(name), given.old_password)) {
      record(request, "change password", "refused", "wrong old password");
      return answer(refusal(403, "the old password is wrong"));
    }
    {
      const std::lock_guard lock(mutex_);
      guard_.succeeded(network_of(request.remote), name);
    }
    Result<std::string> hash = hash_password(given.new_password);
    const Status put = hash ? accounts_.put(name, std::nullopt, *std::move(hash)) : Status(hash.error());
    record(request, "change password", put ? "done" : "refused", put ? "" : put.error().message);
    if (!put) return answer(refusal(503, put.error().message));
    sessions_.end_all(name, request.session);
    answer_when_stored(answer, nothing_more());
  });
}

void LoginService::change_account(const HttpRequest& request, const Answer& answer) {
  if (!is_json(request)) return answer(not_json());
  const Result<AccountMessage> message = parse_account(request.body);
  if (!message) return answer(refusal(400, message.error().message));
  const Status fine = message->password ? check_password(*message->password) : Status();
  if (!fine) return answer(refusal(400, fine.error().message));
  later(request, answer, [this, request, answer, given = *message] {
    std::optional<std::string> hash;
    if (given.password) {
      Result<std::string> hashed = hash_password(*given.password);
      if (!hashed) return answer(refusal(503, hashed.error().message));
      hash = *std::move(hashed);
    }
    const bool new_password = hash.has_value();
    const Status put = accounts_.put(given.name, given.role, std::move(hash));
    const std::string what =
        std::string(given.role ? role_name(*given.role) : "") + (new_password ? " password" : "");
    record(request, "account " + given.name, put ? "done" : "refused", put ? what : put.error().message);
    if (!put) return answer(refusal(409, put.error().message));
    // Ends sessions with the old role or password.
    sessions_.end_all(given.name);
    answer_when_stored(answer, nothing_more());
  });
}

void LoginService::remove_account(const HttpRequest& request, const Answer& answer) {
  const std::optional<std::string> name = query_value(request.query, "name");
  if (!name) return answer(refusal(400, "expected ?name=NAME"));
  later(request, answer, [this, request, answer, given = *name] {
    const Status removed = accounts_.remove(given);
    record(request, "remove account " + given, removed ? "done" : "refused",
           removed ? "" : removed.error().message);
    if (!removed) return answer(refusal(409, removed.error().message));
    sessions_.end_all(given);
    answer_when_stored(answer, nothing_more());
  });
}

void LoginService::log_out(const HttpRequest& request, const Answer& answer) {
  sessions_.end(request.session);
  record(request, "log out", "done", "");
  HttpResponse response = nothing_more();
  response.headers = {{"Set-Cookie", cookie("") + "; Max-Age=0"}};
  answer_when_stored(answer, std::move(response));
}

void LoginService::enter(const HttpRequest& request, const Answer& answer) {
  const std::string digest = token_digest(query_value(request.query, "token").value_or(""));
  std::optional<Identity> who;
  {
    const std::lock_guard lock(mutex_);
    if (const auto link = links_.find(digest); link != links_.end()) who = link->second;
  }
  if (!who) {
    record(request, "enter by a link", "refused", "unknown link");
    return answer(refusal(403, "this link is from an earlier start; see the link that the server printed"));
  }
  // A client that already has the role keeps its name, so that other tabs of this browser go on.
  const bool is_in = request.who && request.who->role == who->role;
  HttpResponse response = is_in ? nothing_more() : begin_session(request, newcomer(*std::move(who)));
  response.status = 303;
  response.headers.emplace_back("Location", "/");
  answer_when_stored(answer, std::move(response));
}

Identity LoginService::newcomer(Identity who) {
  // Whoever has a link is not the account of this name.
  const auto taken = [this](const std::string& name) {
    return sessions_.has(name, steady_()) || accounts_.find(name);
  };
  if (!taken(who.name)) return who;
  for (int number = 2; number <= kMaxPerLink; ++number) {
    std::string name = who.name + "_" + std::to_string(number);
    if (!taken(name)) return {std::move(name), who.role};
  }
  return who;
}

bool LoginService::may_try(const HttpRequest& request, const std::string& name, const Answer& answer) {
  Duration wait;
  {
    const std::lock_guard lock(mutex_);
    wait = guard_.admit(network_of(request.remote), name.substr(0, 64), steady_());
  }
  if (wait.ns == 0) return true;
  const std::string left = std::to_string(static_cast<long>(std::ceil(wait.seconds())));
  record(request, "try a password of " + name, "refused", "too many attempts; wait " + left + " s");
  HttpResponse response = refusal(429, "too many attempts; wait " + left + " s");
  response.headers = {{"Retry-After", left}};
  answer(response);
  return false;
}

void LoginService::later(const HttpRequest& request, const Answer& answer, std::function<void()> task) {
  // Whoever is logged in does not wait for strangers at the same address.
  const std::string client = request.who ? "account " + request.who->name : network_of(request.remote);
  if (work_.take(client, std::move(task))) return;
  HttpResponse response = refusal(503, "too many log-ins at once; try again");
  response.headers = {{"Retry-After", "1"}};
  answer(response);
}

void LoginService::record(const HttpRequest& request, const std::string& what, const std::string& outcome,
                          const std::string& detail) {
  audit_.record({request.who ? request.who->name : "", request.remote, what, outcome, detail});
}

void LoginService::answer_when_stored(const Answer& answer, HttpResponse response) {
  session_file_.save([this, answer, response = std::move(response)](const Status& stored) {
    if (!stored) audit_.record({"", "", "store log-ins", "refused", stored.error().message});
    answer(response);
  });
}

HttpResponse LoginService::begin_session(const HttpRequest& request, const Identity& who) {
  if (!request.session.empty()) sessions_.end(request.session);
  audit_.record({who.name, request.remote, "log in", "done", std::string(role_name(who.role))});
  HttpResponse response = nothing_more();
  const long lasts = static_cast<long>(limits_.absolute.seconds());
  response.headers = {
      {"Set-Cookie", cookie(sessions_.begin(who, steady_())) + "; Max-Age=" + std::to_string(lasts)}};
  return response;
}

std::string LoginService::cookie(const std::string& token) const {
  return cookie_name_ + "=" + token + "; Path=/; HttpOnly; SameSite=Strict" + (encrypted_ ? "; Secure" : "");
}

}  // namespace parhelion::station
