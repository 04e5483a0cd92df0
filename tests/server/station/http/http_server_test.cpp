// The server's response to valid, invalid and malicious requests.
#include "server/station/http/http_server.hpp"

#include <future>
#include <thread>

#include "tests/server/station/http/site_fixture.hpp"

namespace parhelion::test {
namespace {

class Server : public SiteTest {
 protected:
  void SetUp() override {
    SiteTest::SetUp();
    make_accounts({{"anna", station::Role::trainee}});
  }
};

TEST_F(Server, SendsSecurityHeadersWithEachAnswer) {
  open();
  for (const char* path : {"/healthz", "/nothing", "/api/v1/accounts"}) {
    const RawAnswer answer = RawClient(port()).get(path);
    const std::string policy = answer.headers.at("content-security-policy");
    EXPECT_NE(policy.find("default-src 'none'; script-src 'self'"), std::string::npos) << policy;
    EXPECT_NE(policy.find("frame-ancestors 'none'"), std::string::npos) << policy;
    EXPECT_NE(policy.find("connect-src 'self' ws://127.0.0.1:" + std::to_string(port())), std::string::npos)
        << policy;
    EXPECT_EQ(answer.headers.at("x-content-type-options"), "nosniff");
    EXPECT_EQ(answer.headers.at("cache-control"), "no-store");
  }
}

TEST_F(Server, AnswersSeveralRequestsOnOneConnection) {
  open();
  RawClient client(port());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(client.get("/healthz").body, R"({"ok":true})");
  EXPECT_EQ(client.get("/nothing").status, 404);
  EXPECT_EQ(client.post("/healthz", "{}").status, 405);
  RawClient head(port());
  head.send("HEAD /healthz HTTP/1.1\r\nHost: " + head.host() + "\r\n\r\n");
  const RawAnswer answer = head.answer(true);
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.headers.at("content-length"), "11");
  EXPECT_EQ(head.get("/healthz").status, 200) << "no body came after the head";
}

TEST_F(Server, RefusesRequestsBeyondItsLimits) {
  open({.body_bytes = 1000});
  RawClient header(port());
  EXPECT_EQ(header.get("/healthz", "", "X-Long: " + std::string(20'000, 'x') + "\r\n").status, 431);
  RawClient body(port());
  EXPECT_EQ(body.post("/api/v1/login", std::string(1001, 'x')).status, 413);
  RawClient chunked(port());
  chunked.send("POST /api/v1/login HTTP/1.1\r\nHost: " + chunked.host() + "\r\nOrigin: " + chunked.origin() +
               "\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n");
  for (int i = 0; i < 11; ++i) chunked.send("64\r\n" + std::string(100, 'x') + "\r\n");
  EXPECT_EQ(chunked.answer().status, 413);
  EXPECT_NE(audit().find("longer than 1000 bytes"), std::string::npos);
}

TEST_F(Server, RefusesInvalidRequests) {
  open();
  const std::vector<std::string> rubbish = {
      "GET\r\n\r\n",
      "GET / HTTP/9.9\r\n\r\n",
      std::string("\x00\x01\x02\x03\r\n\r\n", 8),
      "GET / HTTP/1.1\r\nno colon\r\n\r\n",
      "POST /api/v1/login HTTP/1.1\r\nContent-Length: -1\r\n\r\n",
      "POST /api/v1/login HTTP/1.1\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n",
      "POST /api/v1/login HTTP/1.1\r\nContent-Length: 9\r\nTransfer-Encoding: chunked\r\n\r\n"};
  for (const std::string& bytes : rubbish) {
    RawClient client(port());
    client.send(bytes);
    EXPECT_EQ(client.answer().status, 400) << bytes;
  }
  RawClient two_faced(port());
  two_faced.send("GET /healthz HTTP/1.1\r\nHost: " + two_faced.host() + "\r\nHost: elsewhere\r\n\r\n");
  EXPECT_EQ(two_faced.answer().status, 400);
  RawClient nameless(port());
  nameless.send("GET /healthz HTTP/1.1\r\n\r\n");
  EXPECT_EQ(nameless.answer().status, 421);
  EXPECT_EQ(RawClient(port()).get("/healthz").status, 200);
}

TEST_F(Server, RefusesPathsOutsideItsFolder) {
  open();
  for (const char* path : {"/../etc/passwd", "/assets/../../accounts.json", "/%2e%2e/accounts.json",
                           "/%2E%2E%2faccounts.json", "/..%5caccounts.json", "/a%00b", "/a%0d%0aSet-Cookie:x",
                           "/%zz", "/%", "etc/passwd", "*", "http://127.0.0.1/healthz"}) {
    const RawAnswer answer = RawClient(port()).get(path);
    EXPECT_EQ(answer.status, 400) << path;
    EXPECT_FALSE(answer.headers.contains("set-cookie")) << path;
  }
  EXPECT_EQ(RawClient(port()).get("//etc/passwd").status, 404);
  EXPECT_EQ(RawClient(port()).get("/accounts.json").status, 404);
}

TEST_F(Server, ClosesConnectionsThatSendTooSlowly) {
  open({.request_time = milliseconds(300)});
  RawClient slow(port());
  slow.send("GET /healthz HTTP/1.1\r\n");
  // Header lines now and then do not extend its timeout.
  int lines = 0;
  while (slow.send("X-" + std::to_string(lines) + ": y\r\n") && lines < 10'000) {
    pollfd end{slow.descriptor(), POLLIN, 0};
    if (::poll(&end, 1, 20) == 1) break;
    ++lines;
  }
  EXPECT_LT(lines, 10'000);
  EXPECT_EQ(slow.rest(), "");
  RawClient body(port());
  body.send("POST /api/v1/login HTTP/1.1\r\nHost: " + body.host() + "\r\nOrigin: " + body.origin() +
            "\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{");
  EXPECT_EQ(body.rest(), "");
  EXPECT_NE(audit().find("a request"), std::string::npos);
}

TEST_F(Server, LimitsConnectionsOfThoseLoggedInAndAcceptsNewOnesAfterwards) {
  open({.connections = 4});
  const std::string cookie = cookie_of("anna");
  {
    std::vector<std::unique_ptr<RawClient>> clients;
    for (int i = 0; i < 4; ++i) {
      clients.push_back(std::make_unique<RawClient>(port()));
      ASSERT_EQ(clients.back()->get("/api/v1/me", cookie).status, 200);
    }
    EXPECT_EQ(RawClient(port()).get("/healthz").status, 0);
    EXPECT_EQ(clients.front()->get("/healthz").status, 200);
  }
  EXPECT_NE(audit().find("too many are open"), std::string::npos);
  // The server detects their disconnection soon, not at once.
  RawAnswer answer;
  for (int i = 0; i < 10'000 && answer.status == 0; ++i) answer = RawClient(port()).get("/healthz");
  EXPECT_EQ(answer.status, 200);
}

TEST_F(Server, ClosesTheOldestIdleConnectionWithoutALogInForANewerOne) {
  open({.connections = 6, .strangers = 3});
  const std::string cookie = cookie_of("anna");
  RawClient page(port()), other_address(port(), false, "127.0.0.2");
  ASSERT_EQ(page.get("/api/v1/me", cookie).status, 200);
  ASSERT_EQ(other_address.get("/healthz").status, 200);
  RawClient oldest(port()), newer(port());
  ASSERT_EQ(oldest.get("/healthz").status, 200);
  ASSERT_EQ(newer.get("/healthz").status, 200);
  EXPECT_EQ(RawClient(port()).get("/healthz").status, 200);
  EXPECT_EQ(oldest.rest(), "") << "of the address with the most";
  EXPECT_EQ(newer.get("/healthz").status, 200);
  EXPECT_EQ(other_address.get("/healthz").status, 200) << "older, but alone at its address";
  EXPECT_EQ(page.get("/api/v1/me", cookie).status, 200);
  EXPECT_NE(audit().find("closed for a newer one"), std::string::npos);
}

TEST_F(Server, IdleConnectionsAreClosedBeforeThoseThatAreServed) {
  open({.connections = 6, .strangers = 2});
  RawClient busy(port()), idle(port());
  ASSERT_EQ(idle.get("/healthz").status, 200);
  busy.send("POST /api/v1/login HTTP/1.1\r\nHost: " + busy.host() + "\r\nOrigin: " + busy.origin() +
            "\r\nContent-Type: application/json\r\nContent-Length: 2\r\n\r\n{");
  // When its header has been read cannot be seen from here, but the answer to a later request shows it.
  ASSERT_EQ(idle.get("/healthz").status, 200);
  EXPECT_EQ(RawClient(port()).get("/healthz").status, 200);
  EXPECT_EQ(idle.rest(), "") << "newer, but idle";
  busy.send("}");
  EXPECT_EQ(busy.answer().status, 400) << "served: what it sent is no log-in";
}

TEST_F(Server, IsNotBlockedByASlowAnswer) {
  station::WebSiteOptions options{.folder = folder_, .plain = true};
  auto site = station::WebSite::open(std::move(options));
  ASSERT_TRUE(site);
  site_ = *std::move(site);
  std::promise<station::HttpServer::Answer> asked;
  site_->server().on_late("GET", "/late", station::Access::everyone(),
                          [&](const station::HttpRequest&, station::HttpServer::Answer answer) {
                            asked.set_value(std::move(answer));
                          });
  site_->server().on_late("GET", "/never", station::Access::everyone(),
                          [](const station::HttpRequest&, const station::HttpServer::Answer&) {});
  site_->run();
  RawClient waiting(port());
  std::thread other([&] {
    const station::HttpServer::Answer answer = asked.get_future().get();
    EXPECT_EQ(RawClient(port()).get("/healthz").status, 200);
    answer({.status = 200, .body = "at last"});
    answer({.status = 200, .body = "twice"});
  });
  EXPECT_EQ(waiting.get("/late").body, "at last");
  other.join();
  EXPECT_EQ(waiting.get("/never").status, 503);
}

TEST_F(Server, StopsWhileAnAnswerIsPending) {
  station::WebSiteOptions options{.folder = folder_, .plain = true};
  site_ = *station::WebSite::open(std::move(options));
  std::promise<station::HttpServer::Answer> asked;
  site_->server().on_late("GET", "/late", station::Access::everyone(),
                          [&](const station::HttpRequest&, station::HttpServer::Answer answer) {
                            asked.set_value(std::move(answer));
                          });
  site_->run();
  RawClient waiting(port());
  waiting.send("GET /late HTTP/1.1\r\nHost: " + waiting.host() + "\r\n\r\n");
  const station::HttpServer::Answer answer = asked.get_future().get();
  site_.reset();
  answer({.status = 200, .body = "nobody is there"});
  EXPECT_EQ(waiting.answer().status, 0);
}

TEST_F(Server, UsesTlsWithItsOwnCertificate) {
  open({}, false);
  EXPECT_EQ(site_->fingerprint().size(), 95U);
  EXPECT_EQ(site_->address().rfind("https://127.0.0.1:", 0), 0U);
  RawClient client(port(), true);
  ASSERT_TRUE(client.connected());
  const RawAnswer answer = client.post("/api/v1/login", R"({"name":"anna","password":"correct horse"})");
  ASSERT_EQ(answer.status, 204) << answer.body;
  const std::string set = answer.headers.at("set-cookie");
  EXPECT_EQ(set.rfind("__Host-parhelion-", 0), 0U) << set;
  EXPECT_NE(set.find("; Secure"), std::string::npos) << set;
  RawClient socket(port(), true);
  ASSERT_EQ(socket.open_socket("/ws/echo", cookie_in(answer)).status, 101);
  socket.send_text("over TLS");
  EXPECT_EQ(socket.frame()->payload, "over TLS");
}

TEST_F(Server, OffersOnlyAuthenticatedEncryptionInTls12) {
  open({}, false);
  for (const char* weak : {"ECDHE+SHA1", "ECDHE+SHA256:!AESGCM:!CHACHA20", "kRSA"})
    EXPECT_FALSE(RawClient(port(), true, nullptr, weak).connected()) << weak;
  EXPECT_TRUE(RawClient(port(), true, nullptr, "ECDHE+AESGCM").connected());
}

TEST_F(Server, RedirectsPlainHttpOnItsTlsPort) {
  open({}, false);
  RawClient client(port());
  const RawAnswer answer = client.get("/setup?token=x");
  EXPECT_EQ(answer.status, 308);
  EXPECT_EQ(answer.headers.at("location"), "https://" + client.host() + "/setup?token=x");
  EXPECT_EQ(RawClient(port()).post("/api/v1/login", R"({"name":"anna","password":"correct horse"})").status,
            308);
}

TEST_F(Server, ReusesItsCertificateAfterARestart) {
  open({}, false);
  const std::string fingerprint = site_->fingerprint();
  site_.reset();
  open({}, false);
  EXPECT_EQ(site_->fingerprint(), fingerprint);
}

TEST(ServerOptions, InvalidOptionsAreReported) {
  const auto open_error = [](station::HttpOptions options) {
    const auto server = station::HttpServer::open(std::move(options));
    return server ? std::string("opened") : server.error().message;
  };
  EXPECT_NE(open_error({.address = "0.0.0.0"}).find("without a certificate"), std::string::npos);
  EXPECT_NE(open_error({.address = "base"}).find("not an address"), std::string::npos);
  EXPECT_NE(open_error({.certificate = "/nowhere/c.pem", .key = "/nowhere/k.pem"}).find("/nowhere/c.pem"),
            std::string::npos);
  EXPECT_NE(open_error({.certificate = "c.pem"}).find("belong together"), std::string::npos);
  const auto first = station::HttpServer::open({});
  ASSERT_TRUE(first);
  EXPECT_NE(open_error({.port = (*first)->port()}).find("cannot listen"), std::string::npos);
}

TEST_F(Server, SurvivesAHandlerThatThrows) {
  auto server = station::HttpServer::open({.address = "localhost"});
  ASSERT_TRUE(server);
  const auto fail = [] { throw std::runtime_error("a fault"); };
  (*server)->on("GET", "/fails", station::Access::everyone(), [&](const station::HttpRequest&) {
    fail();
    return station::HttpResponse{};
  });
  (*server)->on("GET", "/works", station::Access::everyone(),
                [](const station::HttpRequest&) { return station::HttpResponse{}; });
  (*server)->on_socket("/ws", station::Access::everyone(),
                       {.received = [&](station::WebClient&, std::string_view, bool) { fail(); }});
  (*server)->run();
  const std::uint16_t at = (*server)->port();
  EXPECT_EQ(RawClient(at).get("/fails").status, 0);
  RawClient socket(at);
  ASSERT_EQ(socket.open_socket("/ws").status, 101);
  socket.send_text("x");
  EXPECT_EQ(socket.frame()->code(), 1011);
  EXPECT_EQ(RawClient(at).get("/works").status, 200);
  EXPECT_EQ((*server)->counts().refused, 2U);
}

TEST_F(Server, ServesMetricsToLocalAndLoggedInClients) {
  open();
  const RawAnswer figures = RawClient(port()).get("/metrics");
  EXPECT_EQ(figures.status, 200);
  EXPECT_NE(figures.body.find("# TYPE parhelion_http_requests_total counter\nparhelion_http_requests_total "),
            std::string::npos)
      << figures.body;
}

}  // namespace
}  // namespace parhelion::test
