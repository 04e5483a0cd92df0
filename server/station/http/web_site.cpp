#include "server/station/http/web_site.hpp"

#include <cstdlib>

#include "server/runtime/wall_clock.hpp"
#include "server/station/http/certificate.hpp"
#include "server/station/http/login_service.hpp"
#include "server/station/http/private_file.hpp"

namespace parhelion::station {
namespace {

/// The host name in links for people to a server that listens on `address`.
std::string reachable(const std::string& address) {
  if (address != "0.0.0.0" && address != "::") {
    return address.find(':') == std::string::npos ? address : "[" + address + "]";
  }
  for (const std::string& own : own_names()) {
    const bool version_4 = own.find_first_not_of("0123456789.") == std::string::npos;
    if (version_4 && own.rfind("127.", 0) != 0) return own;
  }
  return "localhost";
}

Result<std::string> certificate_for(WebSiteOptions& options) {
  if (options.plain) return std::string();
  if (options.http.certificate.empty()) {
    const std::filesystem::path certificate = options.folder / "certificate.pem",
                                key = options.folder / "key.pem";
    std::vector<std::string> names = own_names();
    names.insert(names.end(), options.http.names.begin(), options.http.names.end());
    if (const Status made = make_certificate(certificate, key, names, options.clock()); !made)
      return made.error();
    options.http.certificate = certificate;
    options.http.key = key;
  }
  return certificate_fingerprint(options.http.certificate);
}

/// Cookies are for one port, so each server of a folder has its own file, and one on any free port needs
/// none.
std::filesystem::path session_file(const WebSiteOptions& options) {
  if (options.http.port == 0) return {};
  return options.folder / ("log-ins-" + std::to_string(options.http.port) + ".json");
}

}  // namespace

struct WebSite::Parts {
  WebSiteOptions options;
  std::string fingerprint;
  std::unique_ptr<Accounts> accounts;
  std::unique_ptr<Audit> audit;
  std::unique_ptr<LoginService> login_service;
  std::vector<std::function<void(MetricsText&)>> metrics;
  std::unique_ptr<HttpServer> server;  ///< last: its handlers use all of the above

  HttpResponse figures() const {
    MetricsText text;
    const HttpCounts counts = server->counts();
    const auto real = [](std::uint64_t count) { return static_cast<double>(count); };
    text.gauge("parhelion_http_connections", "Open connections.", real(counts.connections));
    text.gauge("parhelion_http_clients", "Open WebSockets and picture streams.", real(counts.clients));
    text.gauge("parhelion_http_sessions", "Log-in sessions.", static_cast<double>(login_service->sessions()));
    text.counter("parhelion_http_accepted_total", "Accepted connections.", real(counts.accepted));
    text.counter("parhelion_http_requests_total", "Received requests.", real(counts.requests));
    text.counter("parhelion_http_refused_total", "Requests, messages and connections refused.",
                 real(counts.refused));
    text.counter("parhelion_http_sent_bytes_total", "Bytes sent.", real(counts.sent_bytes));
    text.counter("parhelion_http_received_bytes_total", "Bytes received.", real(counts.received_bytes));
    text.counter("parhelion_http_replaced_total", "Messages that newer ones replaced before they were sent.",
                 real(counts.replaced));
    text.counter("parhelion_audit_lost_total", "Lines of the audit log that were not written.",
                 real(audit->lost()));
    for (const auto& add : metrics) add(text);
    return {.status = 200, .type = MetricsText::kType, .body = text.text()};
  }
};

std::filesystem::path default_site_folder() {
  const char* state = std::getenv("XDG_STATE_HOME");
  if (state && *state == '/') return std::filesystem::path(state) / "parhelion";
  const char* home = std::getenv("HOME");
  return std::filesystem::path(home && *home ? home : ".") / ".local/state/parhelion";
}

WebSite::WebSite(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
WebSite::~WebSite() = default;

Result<std::unique_ptr<WebSite>> WebSite::open(WebSiteOptions given) {
  auto parts = std::make_unique<Parts>();
  parts->options = std::move(given);
  WebSiteOptions& options = parts->options;
  if (!options.clock) options.clock = runtime::wall_now;
  if (!options.steady) options.steady = runtime::steady_now;
  if (const Status made = make_private_folder(options.folder); !made) return made.error();
  Result<std::string> fingerprint = certificate_for(options);
  if (!fingerprint) return fingerprint.error();
  parts->fingerprint = *std::move(fingerprint);

  auto accounts = Accounts::open(options.folder / "accounts.json");
  if (!accounts) return accounts.error();
  parts->accounts = *std::move(accounts);
  auto audit = Audit::open(options.folder / "audit.jsonl", options.clock);
  if (!audit) return audit.error();
  parts->audit = *std::move(audit);
  auto login_service =
      LoginService::open(*parts->accounts, *parts->audit,
                         {options.sessions, {options.clock, options.steady}, session_file(options)});
  if (!login_service) return login_service.error();
  parts->login_service = *std::move(login_service);

  options.http.identify = [login_service = parts->login_service.get()](const std::string& session) {
    return login_service->identify(session);
  };
  options.http.refused = [audit = parts->audit.get()](const WebRefusal& refusal) {
    audit->record({refusal.who, refusal.remote, refusal.what, "refused",
                   (refusal.status > 0 ? std::to_string(refusal.status) + " " : "") + refusal.why});
  };
  auto server = HttpServer::open(options.http);
  if (!server) return server.error();
  parts->server = *std::move(server);

  Parts* all = parts.get();
  all->login_service->serve(*all->server);
  all->server->on("GET", "/healthz", Access::everyone(),
                  [](const HttpRequest&) { return HttpResponse{.status = 200, .body = R"({"ok":true})"}; });
  all->server->on("GET", "/metrics", Access::only({Role::observer, Role::instructor, Role::admin}).or_local(),
                  [all](const HttpRequest&) { return all->figures(); });
  if (options.page) all->server->on("GET", "/", Access::everyone(), options.page);
  return std::unique_ptr<WebSite>(new WebSite(std::move(parts)));
}

HttpServer& WebSite::server() { return *parts_->server; }
Audit& WebSite::audit() { return *parts_->audit; }
void WebSite::metrics(std::function<void(MetricsText&)> add) { parts_->metrics.push_back(std::move(add)); }
void WebSite::run() { parts_->server->run(); }
void WebSite::stop() { parts_->server->stop(); }
const std::string& WebSite::fingerprint() const { return parts_->fingerprint; }

std::string WebSite::address() const {
  return (parts_->server->encrypted() ? "https://" : "http://") + reachable(parts_->options.http.address) +
         ":" + std::to_string(parts_->server->port()) + "/";
}

std::string WebSite::setup_link() const {
  const std::string token = parts_->login_service->setup_token();
  return token.empty() ? "" : address() + "setup?token=" + token;
}

const std::string& WebSite::restore_fault() const { return parts_->login_service->restore_fault(); }

std::string WebSite::link(Role role, const std::string& name) {
  return address() + "enter?token=" + parts_->login_service->make_link({name, role});
}

}  // namespace parhelion::station
