// The parts of a web site, each in isolation.
#include <fstream>
#include <future>

#include "server/station/http/cached_content.hpp"
#include "server/station/http/certificate.hpp"
#include "server/station/http/client_queue.hpp"
#include "server/station/http/login_guard.hpp"
#include "server/station/http/request_checks.hpp"
#include "server/station/http/slow_work.hpp"
#include "tests/file_bytes.hpp"
#include "tests/server/station/http/site_fixture.hpp"

namespace parhelion::test {
namespace {

namespace fs = std::filesystem;

class SiteFolder : public SiteTest {
 protected:
  void SetUp() override {
    SiteTest::SetUp();
    fs::create_directory(folder_);
  }
  std::string text_of(const char* name) { return test::bytes_of(folder_ / name); }
};

TEST_F(SiteFolder, AccountsFileIsReadableOnlyByItsOwner) {
  const fs::path file = folder_ / "accounts.json";
  {
    auto accounts = station::Accounts::open(file);
    ASSERT_TRUE(accounts);
    EXPECT_TRUE((*accounts)->empty());
    ASSERT_TRUE((*accounts)->put_first("root", *station::hash_password("12345678")));
    EXPECT_FALSE((*accounts)->put_first("eve", "hash"));
    ASSERT_TRUE((*accounts)->put("anna", station::Role::trainee, "some hash"));
    EXPECT_FALSE((*accounts)->put("new", station::Role::trainee, std::nullopt)) << "without a password";
    EXPECT_FALSE((*accounts)->put("root", station::Role::observer, std::nullopt)) << "the only admin";
    EXPECT_FALSE((*accounts)->remove("root")) << "the only admin";
    EXPECT_FALSE((*accounts)->remove("nobody"));
  }
  EXPECT_EQ(fs::status(file).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(text_of("accounts.json").find("12345678"), std::string::npos);
  auto again = station::Accounts::open(file);
  ASSERT_TRUE(again);
  EXPECT_EQ((*again)->list().size(), 2U);
  EXPECT_EQ((*again)->find("anna")->role, station::Role::trainee);
  EXPECT_TRUE(station::password_matches((*again)->hash("root"), "12345678"));
  EXPECT_FALSE(station::password_matches((*again)->hash("root"), "12345679"));
  EXPECT_FALSE(station::password_matches((*again)->hash("anna"), "some hash")) << "no hash at all";
}

TEST_F(SiteFolder, ReportsErrorsInAnAccountsFile) {
  const fs::path file = folder_ / "accounts.json";
  for (const char* broken : {"", "{", "[]", R"({"accounts":[{"name":"a"}]})", R"({"accounts":[1]})",
                             R"({"accounts":[{"name":"a","role":"king","password":"x"}]})",
                             R"({"accounts":[{"name":"<a>","role":"admin","password":"x"}]})"}) {
    std::ofstream(file) << broken;
    fs::permissions(file, fs::perms::owner_all);
    const auto accounts = station::Accounts::open(file);
    ASSERT_FALSE(accounts) << broken;
    EXPECT_NE(accounts.error().message.find("accounts.json"), std::string::npos);
  }
  fs::permissions(file, fs::perms::owner_all | fs::perms::others_read);
  const auto open_to_others = station::Accounts::open(file);
  ASSERT_FALSE(open_to_others);
  EXPECT_NE(open_to_others.error().message.find("chmod 600"), std::string::npos);
}

TEST_F(SiteFolder, AppendsToTheAuditLog) {
  const auto clock = [] { return WallTime{1'700'000'000'123'000'000}; };
  for (int start = 0; start < 2; ++start) {
    auto audit = station::Audit::open(folder_ / "audit.jsonl", clock);
    ASSERT_TRUE(audit);
    (*audit)->record({"anna", "10.0.0.1", "spawn \"box\"\n", "done", "\xff"});
  }
  const std::string line =
      "{\"time\":\"2023-11-14T22:13:20.123Z\",\"who\":\"anna\",\"from\":\"10.0.0.1\","
      "\"what\":\"spawn \\\"box\\\"\\n\",\"outcome\":\"done\",\"detail\":\"\xef\xbf\xbd\"}\n";
  EXPECT_EQ(text_of("audit.jsonl"), line + line);
  EXPECT_FALSE(station::Audit::open(folder_ / "no" / "audit.jsonl", clock));
}

TEST_F(SiteFolder, ReplacesItsCertificateOnlyWhenItExpires) {
  const fs::path certificate = folder_ / "c.pem", key = folder_ / "k.pem";
  const WallTime now{1'800'000'000'000'000'000};
  ASSERT_TRUE(station::make_certificate(certificate, key, {"localhost", "127.0.0.1", "::1", "base"}, now));
  EXPECT_EQ(fs::status(key).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  const auto first = station::certificate_fingerprint(certificate);
  ASSERT_TRUE(first);
  ASSERT_TRUE(station::make_certificate(certificate, key, {"localhost"}, now + seconds(699 * 86400.0)));
  EXPECT_EQ(*station::certificate_fingerprint(certificate), *first);
  ASSERT_TRUE(station::make_certificate(certificate, key, {"localhost"}, now + seconds(701 * 86400.0)));
  EXPECT_NE(*station::certificate_fingerprint(certificate), *first);
  fs::remove(key);
  const Status half = station::make_certificate(certificate, key, {"localhost"}, now);
  ASSERT_FALSE(half);
  EXPECT_NE(half.error().message.find("exists, but"), std::string::npos);
  std::ofstream(certificate) << "rubbish";
  EXPECT_FALSE(station::certificate_fingerprint(certificate));
}

TEST(RequestTargets, AreDecodedOnceAndStayInside) {
  EXPECT_EQ(station::parse_target("/a%20b?c=%20")->path, "/a b");
  EXPECT_EQ(station::parse_target("/a%20b?c=%20")->query, "c=%20");
  EXPECT_EQ(station::parse_target("/%252e%252e")->path, "/%2e%2e") << "once";
  for (const char* bad : {"", "a", "/..", "/%2e.", "/a\\b", "/%00", "/\x7f", "/%f", "?a"})
    EXPECT_FALSE(station::parse_target(bad)) << bad;
}

TEST(AllowedHosts, AcceptAddressesAndConfiguredNames) {
  const station::HostNames names({"Base.Example"});
  for (const char* known : {"localhost", "localhost:8443", "127.0.0.1:1", "[::1]:8443", "192.168.1.5",
                            "base.example:80", "BASE.EXAMPLE"}) {
    EXPECT_TRUE(names.knows(known)) << known;
  }
  for (const char* unknown :
       {"", "evil.example", "localhost.evil.example", "base.example:", "base.example:x", "[::1",
        "127.0.0.1:1:1", "127.0.0.1.evil.example", "base.example@evil.example", "localhost\t"}) {
    EXPECT_FALSE(names.knows(unknown)) << unknown;
  }
  EXPECT_EQ(station::network_of("192.168.1.5"), "192.168.1.5");
  EXPECT_EQ(station::network_of("2001:db8:1:2:3:4:5:6"), station::network_of("2001:db8:1:2::1"));
  EXPECT_NE(station::network_of("2001:db8:1:2::1"), station::network_of("2001:db8:1:3::1"));
}

TEST(LoginGuard, DoublesTheDelayAndResetsLater) {
  station::LoginGuard guard;
  WallTime now{1'000'000'000'000};
  for (int i = 0; i < 5; ++i) EXPECT_EQ(guard.admit("a", "anna", now).ns, 0) << i;
  for (const double wait : {1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 60.0, 60.0}) {
    EXPECT_EQ(guard.admit("a", "anna", now), seconds(wait));
    EXPECT_EQ(guard.admit("b", "anna", now), seconds(wait)) << "from elsewhere, too";
    now = now + seconds(wait);
    EXPECT_EQ(guard.admit("a", "anna", now).ns, 0);
  }
  EXPECT_EQ(guard.admit("a", "otto", now).ns, 0) << "others go on";
  guard.succeeded("a", "otto");
  EXPECT_GT(guard.admit("a", "anna", now).ns, 0) << "another's success does not help";
  now = now + seconds(3601.0);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(guard.admit("a", "anna", now).ns, 0) << i;
}

TEST(LoginGuard, IsBoundedForUnlimitedNames) {
  station::LoginGuard guard;
  WallTime now{1'000'000'000'000};
  for (int i = 0; i < 6; ++i) (void)guard.admit("x", "anna", now);
  for (int i = 0; i < 3000; ++i) (void)guard.admit("n" + std::to_string(i), "u" + std::to_string(i), now);
  EXPECT_GT(guard.admit("y", "anna", now).ns, 0) << "who is held up is not forgotten for others";
}

TEST(SlowWork, ServesClientsInTurnAndLimitsEach) {
  std::vector<std::string> done;
  std::promise<void> begun, go_on, ended;
  station::SlowWork work({.waiting = 6, .waiting_per_client = 3});
  ASSERT_TRUE(work.take("a", [&] {
    begun.set_value();
    go_on.get_future().wait();
  }));
  begun.get_future().wait();
  for (const std::string task : {"a1", "a2", "a3", "b1", "b2"}) {
    EXPECT_TRUE(work.take(task.substr(0, 1), [&done, &ended, task] {
      done.push_back(task);
      if (task == "a3") ended.set_value();
    })) << task;
  }
  EXPECT_FALSE(work.take("a", [] {})) << "three of this client wait";
  EXPECT_TRUE(work.take("c", [&] { done.push_back("c1"); }));
  EXPECT_FALSE(work.take("d", [] {})) << "six wait in all";
  go_on.set_value();
  ended.get_future().wait();
  EXPECT_EQ(done, (std::vector<std::string>{"a1", "b1", "c1", "a2", "b2", "a3"}));
}

TEST(ClientQueue, ReplacesQueuedMessagesOfASlotInPlace) {
  int woken = 0;
  station::ClientQueue queue({}, 1000, [&] { ++woken; });
  const auto send = [&](const char* text, int slot) {
    queue.send(std::make_shared<const std::string>(text), false, slot);
  };
  send("a", station::WebClient::kInOrder);
  send("old", 3);
  send("b", station::WebClient::kInOrder);
  send("new!", 3);
  EXPECT_EQ(woken, 1);
  EXPECT_EQ(queue.waiting_bytes(), 6U);
  EXPECT_EQ(queue.replaced(), 1U);
  std::string order;
  for (auto next = queue.take(); next.message; next = queue.take()) order += *next.message->bytes + ' ';
  EXPECT_EQ(order, "a new! b ");
  EXPECT_EQ(queue.waiting_bytes(), 0U);
  send("c", 3);
  EXPECT_EQ(woken, 2);
}

TEST(ClientQueue, ClosesOnceAndDropsLaterMessages) {
  station::ClientQueue queue({}, 200, [] {});
  for (int i = 0; i < 5; ++i)
    queue.send(std::make_shared<const std::string>("0123456789"), false, station::WebClient::kInOrder);
  const auto next = queue.take();
  ASSERT_TRUE(next.closing);
  EXPECT_EQ(next.closing->code, 1013);
  queue.close(1000, "again");
  queue.send(std::make_shared<const std::string>("more"), false, 1);
  EXPECT_FALSE(queue.take().closing);
  EXPECT_EQ(queue.waiting_bytes(), 0U);
}

TEST(CachedContent, IsCompressedOnceAndNotResent) {
  const station::CachedContent content = station::cached_content("text/plain", std::string(10'000, 'x'));
  station::HttpRequest request;
  const station::HttpResponse plain = station::answer_with(request, content);
  EXPECT_EQ(plain.shared_body->size(), 10'000U);
  request.accept_encoding = "br, gzip";
  const station::HttpResponse packed = station::answer_with(request, content);
  EXPECT_LT(packed.shared_body->size(), 100U);
  request.if_none_match = content.etag;
  const station::HttpResponse known = station::answer_with(request, content);
  EXPECT_EQ(known.status, 304);
  EXPECT_FALSE(known.shared_body);
  EXPECT_NE(station::cached_content("text/plain", "x").etag, content.etag);
}

TEST(MetricsText, GroupsValuesByName) {
  station::MetricsText text;
  text.gauge("a_seconds", "How long\nit takes.", 0.5, {{"stage", "x\"y\\"}});
  text.counter("b_total", "Of b.", 3);
  text.gauge("a_seconds", "", 1e-7, {{"stage", "z"}, {"q", "0.5"}});
  EXPECT_EQ(
      text.text(),
      "# HELP a_seconds How long\\nit takes.\n# TYPE a_seconds gauge\na_seconds{stage=\"x\\\"y\\\\\"} 0.5\n"
      "a_seconds{stage=\"z\",q=\"0.5\"} 1e-07\n# HELP b_total Of b.\n# TYPE b_total counter\nb_total 3\n");
}

}  // namespace
}  // namespace parhelion::test
