// Log-in, log-out, the first account, and account management: the routes below /api/v1.
#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "server/station/http/accounts.hpp"
#include "server/station/http/audit.hpp"
#include "server/station/http/http_server.hpp"
#include "server/station/http/login_guard.hpp"
#include "server/station/http/session_file.hpp"
#include "server/station/http/sessions.hpp"
#include "server/station/http/slow_work.hpp"

namespace parhelion::station {

struct LoginOptions {
  SessionLimits limits;
  SessionClocks clocks;
  std::filesystem::path session_file;  ///< empty: a restart logs everybody out
};

class LoginService {
 public:
  /// Error: no memory for argon2.
  static Result<std::unique_ptr<LoginService>> open(Accounts& accounts, Audit& audit, LoginOptions options);

  /// Registers its paths. This object must outlive `server`.
  void serve(HttpServer& server);
  std::optional<Identity> identify(const std::string& session);

  /// The token that creates the first account, once; empty: there are accounts.
  std::string setup_token() const { return accounts_.empty() ? setup_token_ : ""; }
  /// A token that logs in anybody who has it, as `who`, as long as this process lives. If the name is already
  /// logged in, a number is appended to it: two people never drive as one.
  std::string make_link(Identity who);
  std::size_t sessions() const { return sessions_.count(); }
  /// Why everybody has to log in again, for people; empty: the sessions of the server before were restored.
  const std::string& restore_fault() const { return restore_fault_; }

 private:
  using Answer = HttpServer::Answer;

  LoginService(Accounts& accounts, Audit& audit, LoginOptions options);
  void restore_sessions();
  void log_in(const HttpRequest& request, const Answer& answer);
  void set_up(const HttpRequest& request, const Answer& answer);
  void change_password(const HttpRequest& request, const Answer& answer);
  void change_account(const HttpRequest& request, const Answer& answer);
  void remove_account(const HttpRequest& request, const Answer& answer);
  void log_out(const HttpRequest& request, const Answer& answer);
  void enter(const HttpRequest& request, const Answer& answer);
  Identity newcomer(Identity who);

  /// False if this address or name has to wait; the refusal has then been sent.
  bool may_try(const HttpRequest& request, const std::string& name, const Answer& answer);
  void later(const HttpRequest& request, const Answer& answer, std::function<void()> task);
  void record(const HttpRequest& request, const std::string& what, const std::string& outcome,
              const std::string& detail);
  /// Answers once the change of the sessions is on the disk.
  void answer_when_stored(const Answer& answer, HttpResponse response);
  HttpResponse begin_session(const HttpRequest& request, const Identity& who);
  std::string cookie(const std::string& token) const;

  Accounts& accounts_;
  Audit& audit_;
  const SessionLimits limits_;
  const std::function<WallTime()> steady_;
  Sessions sessions_;
  SessionFile session_file_;
  std::string restore_fault_, setup_token_, nobody_hash_, cookie_name_;
  bool encrypted_ = false;

  std::mutex mutex_;
  LoginGuard guard_;
  std::map<std::string, Identity> links_;  ///< by token_digest

  SlowWork work_;  ///< last: its tasks use all of the above
};

}  // namespace parhelion::station
