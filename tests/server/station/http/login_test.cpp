// Log-in, and the routes available without it or with other roles.
#include <fstream>

#include "tests/server/station/http/site_fixture.hpp"

namespace parhelion::test {
namespace {

using LogIn = SiteTest;

TEST_F(LogIn, SetsAnHttpOnlySameSiteCookie) {
  make_accounts({{"anna", station::Role::trainee}});
  open();
  const RawAnswer answer = log_in("anna", kPassword);
  ASSERT_EQ(answer.status, 204);
  const std::string set = answer.headers.at("set-cookie");
  EXPECT_NE(set.find("; HttpOnly"), std::string::npos) << set;
  EXPECT_NE(set.find("; SameSite=Strict"), std::string::npos) << set;
  EXPECT_EQ(set.rfind("parhelion-" + std::to_string(port()) + "=", 0), 0U) << set;
  const RawAnswer me = RawClient(port()).get("/api/v1/me", cookie_in(answer));
  EXPECT_EQ(me.status, 200);
  EXPECT_EQ(me.body, R"({"name":"anna","role":"trainee"})");
  EXPECT_NE(audit().find(R"("who":"anna","from":"127.0.0.1","what":"log in","outcome":"done")"),
            std::string::npos);
}

TEST_F(LogIn, RefusesWrongPasswordsAndUnknownNamesIdentically) {
  make_accounts({{"anna", station::Role::trainee}});
  open();
  const RawAnswer wrong = log_in("anna", "not that one"), unknown = log_in("nobody", "not that one");
  EXPECT_EQ(wrong.status, 401);
  EXPECT_EQ(unknown.status, 401);
  EXPECT_EQ(wrong.body, unknown.body);
  EXPECT_FALSE(wrong.headers.contains("set-cookie"));
  EXPECT_NE(audit().find("log in as nobody"), std::string::npos);
}

TEST_F(LogIn, IsRequiredForAllNonPublicPages) {
  make_accounts({});
  open();
  for (const char* path : {"/desk", "/api/v1/accounts", "/api/v1/audit"}) {
    EXPECT_EQ(RawClient(port()).get(path).status, 401) << path;
    EXPECT_EQ(RawClient(port()).get(path, "parhelion-" + std::to_string(port()) + "=made-up").status, 401)
        << path;
  }
  EXPECT_EQ(RawClient(port()).get("/api/v1/me").status, 401);
  EXPECT_EQ(RawClient(port()).open_socket("/ws/echo").status, 401);
  EXPECT_EQ(RawClient(port()).post("/api/v1/logout", "").status, 401);
  EXPECT_EQ(RawClient(port()).get("/healthz").status, 200);
  EXPECT_NE(audit().find("GET /ws/echo"), std::string::npos);
  EXPECT_EQ(opened, 0);
}

TEST_F(LogIn, OneRoleCannotOpenPagesOfAnother) {
  make_accounts({{"anna", station::Role::trainee},
                 {"olga", station::Role::observer},
                 {"ivan", station::Role::instructor}});
  open();
  for (const char* name : {"anna", "olga"}) {
    const std::string cookie = cookie_of(name);
    EXPECT_EQ(RawClient(port()).get("/desk", cookie).status, 403) << name;
    EXPECT_EQ(RawClient(port()).open_socket("/ws/desk", cookie).status, 403) << name;
    EXPECT_EQ(RawClient(port()).get("/api/v1/accounts", cookie).status, 403) << name;
    EXPECT_EQ(RawClient(port()).get("/api/v1/audit", cookie).status, 403) << name;
    const std::string made_admin = std::string(R"({"name":")") + name + R"(","role":"admin"})";
    EXPECT_EQ(RawClient(port()).post("/api/v1/accounts", made_admin, cookie).status, 403) << name;
  }
  EXPECT_EQ(opened, 0);
  const std::string instructor = cookie_of("ivan");
  EXPECT_EQ(RawClient(port()).get("/desk", instructor).status, 200);
  EXPECT_EQ(RawClient(port()).open_socket("/ws/desk", instructor).status, 101);
  EXPECT_EQ(RawClient(port()).get("/api/v1/accounts", instructor).status, 403);
  EXPECT_NE(audit().find("not with the role trainee"), std::string::npos);
}

TEST_F(LogIn, LogOutInvalidatesTheCookie) {
  make_accounts({{"anna", station::Role::trainee}});
  open();
  const std::string cookie = cookie_of("anna");
  RawClient socket(port());
  ASSERT_EQ(socket.open_socket("/ws/echo", cookie).status, 101);
  const RawAnswer out = RawClient(port()).post("/api/v1/logout", "", cookie);
  EXPECT_EQ(out.status, 204);
  EXPECT_NE(out.headers.at("set-cookie").find("Max-Age=0"), std::string::npos);
  EXPECT_EQ(RawClient(port()).get("/api/v1/me", cookie).status, 401);
  EXPECT_EQ(RawClient(port()).open_socket("/ws/echo", cookie).status, 401);
  // Open sockets are closed, too.
  const auto frame = socket.frame();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->opcode, 8);
  EXPECT_EQ(frame->code(), 1008);
}

TEST_F(LogIn, ExpiresWhenUnusedAndAlwaysAfterADay) {
  make_accounts({{"anna", station::Role::trainee}});
  open();
  const std::string cookie = cookie_of("anna");
  for (int hour = 0; hour < 11; ++hour) {
    pass(seconds(3600.0));
    ASSERT_EQ(RawClient(port()).get("/api/v1/me", cookie).status, 200) << hour;
  }
  pass(seconds(3600.0));
  EXPECT_EQ(RawClient(port()).get("/api/v1/me", cookie).status, 401)
      << "used all the time, but twelve hours old";
  const std::string unused = cookie_of("anna");
  pass(seconds(2 * 3600.0));
  EXPECT_EQ(RawClient(port()).get("/api/v1/me", unused).status, 401) << "unused for two hours";
  EXPECT_EQ(RawClient(port()).open_socket("/ws/echo", unused).status, 401);
  EXPECT_NE(audit().find("the session has ended; log in again"), std::string::npos);
}

TEST_F(LogIn, EndsWhenItsAccountChanges) {
  make_accounts({{"ivan", station::Role::instructor}});
  open();
  const std::string root = cookie_of("root"), instructor = cookie_of("ivan");
  EXPECT_EQ(RawClient(port()).post("/api/v1/accounts", R"({"name":"ivan","role":"observer"})", root).status,
            204);
  EXPECT_EQ(RawClient(port()).get("/desk", instructor).status, 401);
  EXPECT_EQ(RawClient(port()).get("/desk", cookie_of("ivan")).status, 403);
  const std::string observer = cookie_of("ivan");
  RawClient remover(port());
  EXPECT_EQ(remover.post_from(remover.origin(), "/api/v1/accounts?name=ivan", "", root, "DELETE").status,
            204);
  EXPECT_EQ(RawClient(port()).get("/api/v1/me", observer).status, 401);
  EXPECT_EQ(log_in("ivan", kPassword).status, 401);
  EXPECT_EQ(
      RawClient(port()).post_from(remover.origin(), "/api/v1/accounts?name=root", "", root, "DELETE").status,
      409);
}

TEST_F(LogIn, CrossOriginRequestsAreRefused) {
  make_accounts({{"anna", station::Role::trainee}});
  open();
  const std::string cookie = cookie_of("anna");
  const std::string own = "http://127.0.0.1:" + std::to_string(port());
  for (const std::string& origin :
       {std::string(), std::string("null"), std::string("http://evil.example"), "https" + own.substr(4),
        own + "0", own + "/", std::string("http://127.0.0.1")}) {
    EXPECT_EQ(RawClient(port())
                  .post_from(origin, "/api/v1/login", R"({"name":"anna","password":"correct horse"})")
                  .status,
              403)
        << origin;
    EXPECT_EQ(RawClient(port()).post_from(origin, "/api/v1/logout", "", cookie).status, 403) << origin;
    EXPECT_EQ(RawClient(port()).open_socket_from(origin, "/ws/echo", cookie).status, 403) << origin;
  }
  EXPECT_EQ(opened, 0);
  EXPECT_EQ(RawClient(port()).get("/api/v1/me", cookie).status, 200) << "nobody was logged out";
  // DNS rebinding: a name of an attacker that resolves to this machine.
  RawClient rebound(port());
  rebound.send("GET /healthz HTTP/1.1\r\nHost: evil.example:" + std::to_string(port()) + "\r\n\r\n");
  EXPECT_EQ(rebound.answer().status, 421);
  EXPECT_NE(audit().find("another site's"), std::string::npos);
}

TEST_F(LogIn, TenThousandAttemptsAreRefusedCheaply) {
  make_accounts({{"anna", station::Role::trainee}});
  open();
  RawClient attacker(port());
  int hashed = 0, held = 0;
  for (int i = 0; i < 10'000; ++i) {
    const RawAnswer answer =
        attacker.post("/api/v1/login", R"({"name":"anna","password":"guess )" + std::to_string(i) + "\"}");
    if (answer.status == 401) ++hashed;
    if (answer.status == 429) {
      ++held;
      ASSERT_GE(std::stoi(answer.headers.at("retry-after")), 1);
    }
  }
  EXPECT_EQ(hashed, 5);
  EXPECT_EQ(held, 9'995);
  // The right password waits as well, for a minute at most.
  EXPECT_EQ(log_in("anna", kPassword).status, 429);
  pass(seconds(60.0));
  EXPECT_EQ(log_in("anna", kPassword).status, 204);
  // Recorded, but not ten thousand times.
  site_.reset();
  std::ifstream log(folder_ / "audit.jsonl");
  int lines = 0;
  bool summed = false;
  for (std::string line; std::getline(log, line); ++lines)
    summed |= line.find("9971 more") != std::string::npos;
  EXPECT_LT(lines, 60);
  EXPECT_TRUE(summed) << "9,995 and one held, five wrong: thirty in full";
}

TEST_F(LogIn, ManyNamesFromOneAddressAreRateLimited) {
  make_accounts({});
  open();
  RawClient attacker(port());
  int tried = 0;
  for (int i = 0; i < 60; ++i) {
    tried +=
        attacker.post("/api/v1/login", R"({"name":"user)" + std::to_string(i) + R"(","password":"12345678"})")
            .status == 401;
  }
  EXPECT_EQ(tried, 30);
}

TEST_F(LogIn, SixtyAtOnceFromOneAddressDoNotShutOutAnother) {
  make_accounts({{"anna", station::Role::trainee}});
  open();
  std::vector<std::unique_ptr<RawClient>> crowd;
  for (int i = 0; i < 60; ++i) {
    crowd.push_back(std::make_unique<RawClient>(port()));
    const std::string body = R"({"name":"user)" + std::to_string(i) + R"(","password":"12345678"})";
    ASSERT_TRUE(crowd.back()->send_post("/api/v1/login", body));
  }
  RawClient elsewhere(port(), false, "127.0.0.2");
  EXPECT_EQ(elsewhere.post("/api/v1/login", R"({"name":"anna","password":"correct horse"})").status, 204);
  std::map<int, int> answers;
  for (const auto& each : crowd) ++answers[each->answer().status];
  EXPECT_EQ(answers, (std::map<int, int>{{401, 30}, {429, 30}})) << "bounded by the wait, not by the queue";
}

TEST_F(LogIn, RefusesInvalidLogInMessages) {
  make_accounts({});
  open();
  const std::string long_text(2000, 'x');
  for (const std::string& body :
       {std::string(), std::string("{}"), std::string("[]"), std::string("null"), std::string("{"),
        std::string(R"({"name":"a"})"), std::string(R"({"name":1,"password":"b"})"),
        std::string(R"({"name":"a","password":"b","role":"admin"})"),
        R"({"name":")" + long_text + R"(","password":"b"})", std::string(60'000, '[')}) {
    EXPECT_EQ(RawClient(port()).post("/api/v1/login", body).status, 400) << body.substr(0, 80);
  }
  RawClient form(port());
  form.send("POST /api/v1/login HTTP/1.1\r\nHost: " + form.host() + "\r\nOrigin: " + form.origin() +
            "\r\nContent-Type: text/plain\r\nContent-Length: 2\r\n\r\n{}");
  EXPECT_EQ(form.answer().status, 415);
}

TEST_F(LogIn, EscapesScriptsInNamesInPagesAndLogs) {
  make_accounts({});
  open();
  const std::string root = cookie_of("root");
  const std::string script = R"(<script>alert(1)<\/script>)";
  EXPECT_EQ(RawClient(port())
                .post("/api/v1/accounts",
                      R"({"name":")" + script + R"(","role":"trainee","password":"12345678"})", root)
                .status,
            409);
  EXPECT_EQ(log_in(script + R"(\n{\"who\":\"root\"})", "12345678").status, 401);
  const RawAnswer seen = RawClient(port()).get("/api/v1/audit", root);
  EXPECT_EQ(seen.headers.at("content-type"), "application/json");
  EXPECT_EQ(seen.headers.at("x-content-type-options"), "nosniff");
  EXPECT_NE(seen.body.find(R"(\n{\"who\":\"root\"})"), std::string::npos) << "as text within its line";
}

TEST_F(LogIn, ChangingThePasswordEndsAllOtherSessions) {
  make_accounts({{"anna", station::Role::trainee}, {"tom", station::Role::trainee}});
  open();
  const std::string here = cookie_of("anna"), elsewhere = cookie_of("anna"), other = cookie_of("tom");
  RawClient socket(port());
  ASSERT_EQ(socket.open_socket("/ws/echo", elsewhere).status, 101);
  const auto change = [&](const std::string& old, const std::string& fresh, const std::string& cookie) {
    return RawClient(port())
        .post("/api/v1/password", R"({"old":")" + old + R"(","new":")" + fresh + "\"}", cookie)
        .status;
  };
  EXPECT_EQ(change(kPassword, "a better one", ""), 401);
  EXPECT_EQ(change(kPassword, "short", here), 400);
  EXPECT_EQ(change("not that one", "a better one", here), 403);
  EXPECT_EQ(RawClient(port()).post("/api/v1/password", R"({"new":"a better one"})", here).status, 400);
  EXPECT_EQ(log_in("anna", kPassword).status, 204) << "nothing was changed so far";
  EXPECT_EQ(change(kPassword, "a better one", here), 204);
  EXPECT_EQ(RawClient(port()).get("/api/v1/me", here).status, 200);
  EXPECT_EQ(RawClient(port()).get("/api/v1/me", other).status, 200);
  EXPECT_EQ(RawClient(port()).get("/api/v1/me", elsewhere).status, 401);
  const auto frame = socket.frame();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->code(), 1008);
  EXPECT_EQ(log_in("anna", kPassword).status, 401);
  EXPECT_EQ(log_in("anna", "a better one").status, 204);
  const std::string log = audit();
  EXPECT_NE(log.find(R"("who":"anna","from":"127.0.0.1","what":"change password","outcome":"done")"),
            std::string::npos)
      << log;
  EXPECT_NE(log.find("wrong old password"), std::string::npos);
  EXPECT_EQ(log.find("better"), std::string::npos) << "no password is written down";
}

TEST_F(LogIn, PasswordChangesAreRateLimited) {
  make_accounts({{"anna", station::Role::trainee}});
  open();
  const std::string cookie = cookie_of("anna");
  RawClient client(port());
  int tried = 0, held = 0;
  for (int i = 0; i < 50; ++i) {
    const std::string guess = std::to_string(i);
    const RawAnswer answer =
        client.post("/api/v1/password", R"({"old":"guess )" + guess + R"(","new":"12345678"})", cookie);
    tried += answer.status == 403;
    held += answer.status == 429 && answer.headers.contains("retry-after");
  }
  EXPECT_EQ(tried, 5);
  EXPECT_EQ(held, 45);
}

using FirstStart = SiteTest;

std::string body(const std::string& with, const std::string& name, const std::string& secret) {
  return R"({"token":")" + with + R"(","name":")" + name + R"(","password":")" + secret + "\"}";
}

TEST_F(FirstStart, ASingleUseLinkCreatesTheFirstAdmin) {
  open();
  const std::string link = site_->setup_link();
  const std::string token = link.substr(link.find("token=") + 6);
  EXPECT_EQ(RawClient(port()).post("/api/v1/setup", body("guessed", "eve", "12345678")).status, 403);
  EXPECT_EQ(RawClient(port()).post("/api/v1/setup", body(token, "a b", "12345678")).status, 400);
  EXPECT_EQ(RawClient(port()).post("/api/v1/setup", body(token, "root", "short")).status, 400);
  const RawAnswer made = RawClient(port()).post("/api/v1/setup", body(token, "root", "12345678"));
  EXPECT_EQ(made.status, 204) << made.body;
  EXPECT_EQ(RawClient(port()).get("/api/v1/me", cookie_in(made)).body, R"({"name":"root","role":"admin"})");
  EXPECT_EQ(RawClient(port()).post("/api/v1/setup", body(token, "eve", "12345678")).status, 403);
  EXPECT_EQ(site_->setup_link(), "");
}

TEST_F(FirstStart, LogInLinksWorkUntilTheProcessEnds) {
  open();
  const std::string link = site_->link(station::Role::instructor, "demo");
  const std::string target = link.substr(link.find("/enter"));
  const RawAnswer entered = RawClient(port()).get(target);
  EXPECT_EQ(entered.status, 303);
  EXPECT_EQ(entered.headers.at("location"), "/");
  EXPECT_EQ(RawClient(port()).get("/desk", cookie_in(entered)).status, 200);
  EXPECT_EQ(RawClient(port()).get("/api/v1/accounts", cookie_in(entered)).status, 403);
  EXPECT_EQ(RawClient(port()).get("/enter?token=guessed").status, 403);
  EXPECT_EQ(RawClient(port()).get("/enter").status, 403);
  EXPECT_EQ(
      RawClient(port()).post("/api/v1/password", R"({"old":"","new":"12345678"})", cookie_in(entered)).status,
      403)
      << "a link has no password";
}

TEST_F(FirstStart, PeopleEnteringByOneLinkGetDifferentNames) {
  open();
  const std::string link = site_->link(station::Role::trainee, "trainee"), token = site_->setup_link();
  const std::string target = link.substr(link.find("/enter"));
  const RawAnswer admin = RawClient(port()).post(
      "/api/v1/setup", body(token.substr(token.find("token=") + 6), "trainee_2", "12345678"));
  ASSERT_EQ(admin.status, 204) << admin.body;
  const auto name = [&](const RawAnswer& entered) {
    return RawClient(port()).get("/api/v1/me", cookie_in(entered)).body;
  };
  const RawAnswer first = RawClient(port()).get(target), second = RawClient(port()).get(target);
  EXPECT_EQ(name(first), R"({"name":"trainee","role":"trainee"})");
  EXPECT_EQ(name(second), R"({"name":"trainee_3","role":"trainee"})") << "trainee_2 has an account";
  const RawAnswer again = RawClient(port()).get(target, cookie_in(second));
  EXPECT_EQ(again.status, 303);
  EXPECT_EQ(again.headers.count("set-cookie"), 0U) << "another tab of the same browser";
  EXPECT_EQ(name(second), R"({"name":"trainee_3","role":"trainee"})") << "and the first one goes on";
  EXPECT_EQ(RawClient(port()).post("/api/v1/logout", "", cookie_in(first)).status, 204);
  EXPECT_EQ(name(RawClient(port()).get(target)), R"({"name":"trainee","role":"trainee"})");
  EXPECT_EQ(name(RawClient(port()).get(target, cookie_in(admin))), R"({"name":"trainee_4","role":"trainee"})")
      << "who comes as another is another";
}

}  // namespace
}  // namespace parhelion::test
