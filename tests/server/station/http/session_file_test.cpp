// Log-ins that survive the server, and the files that are not trusted to bring them back.
#include <fstream>

#include "server/station/http/token.hpp"
#include "tests/file_bytes.hpp"
#include "tests/server/station/http/site_fixture.hpp"

namespace parhelion::test {
namespace {

namespace fs = std::filesystem;

class KeptLogIns : public SiteTest {
 protected:
  void SetUp() override {
    SiteTest::SetUp();
    make_accounts({{"anna", station::Role::trainee}, {"ivan", station::Role::instructor}});
    restart();
  }
  void restart() {
    site_.reset();
    open({.port = port_});
  }
  /// As after a power cut: the next server finds the file as it was, and not as an orderly end leaves it.
  void restart_with(const std::string& text) {
    site_.reset();
    write(text);
    restart();
  }
  void write(const std::string& text) {
    fs::remove(file());
    std::ofstream(file()) << text;
    fs::permissions(file(), fs::perms::owner_read | fs::perms::owner_write);
  }
  fs::path file() const { return folder_ / ("log-ins-" + std::to_string(port_) + ".json"); }
  std::string text() const { return test::bytes_of(file()); }
  int status_of(const std::string& cookie) { return RawClient(port_).get("/api/v1/me", cookie).status; }

  const std::uint16_t port_ = free_port();
};

TEST_F(KeptLogIns, SurviveARestart) {
  const std::string cookie = cookie_of("ivan");
  restart_with(text());
  EXPECT_EQ(RawClient(port_).get("/desk", cookie).status, 200);
  RawClient socket(port_);
  EXPECT_EQ(socket.open_socket("/ws/desk", cookie).status, 101);
  EXPECT_EQ(site_->restore_fault(), "");
  EXPECT_NE(audit().find(R"("what":"restore log-ins","outcome":"done","detail":"1")"), std::string::npos)
      << audit();
}

TEST_F(KeptLogIns, AreOnTheDiskAsHashesForTheOwnerAloneBeforeTheAnswer) {
  const std::string cookie = cookie_of("ivan");
  const std::string token = cookie.substr(cookie.find('=') + 1), kept = text();
  EXPECT_EQ(kept.find(token), std::string::npos);
  EXPECT_NE(kept.find(station::token_digest(token)), std::string::npos) << kept;
  EXPECT_NE(kept.find(R"("account": "ivan")"), std::string::npos) << kept;
  EXPECT_EQ(fs::status(file()).permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST_F(KeptLogIns, AreGoneAfterALogOut) {
  const std::string cookie = cookie_of("ivan"), before = text();
  ASSERT_NE(before.find("ivan"), std::string::npos);
  ASSERT_EQ(RawClient(port_).post("/api/v1/logout", "", cookie).status, 204);
  restart_with(text());
  EXPECT_EQ(status_of(cookie), 401);
}

TEST_F(KeptLogIns, OfAnOldPasswordAreNotRestoredEvenFromAnOldFile) {
  const std::string cookie = cookie_of("ivan"), root = cookie_of("root"), before = text();
  ASSERT_EQ(
      RawClient(port_).post("/api/v1/accounts", R"({"name":"ivan","password":"another horse"})", root).status,
      204);
  EXPECT_EQ(text().find("ivan"), std::string::npos);
  restart_with(before);
  EXPECT_EQ(status_of(cookie), 401);
  EXPECT_EQ(status_of(root), 200);
}

TEST_F(KeptLogIns, OfARemovedAccountOrAnotherRoleAreNotRestoredEvenFromAnOldFile) {
  const std::string anna = cookie_of("anna"), ivan = cookie_of("ivan"), root = cookie_of("root");
  const std::string before = text();
  RawClient remover(port_);
  ASSERT_EQ(remover.post_from(remover.origin(), "/api/v1/accounts?name=anna", "", root, "DELETE").status,
            204);
  ASSERT_EQ(RawClient(port_).post("/api/v1/accounts", R"({"name":"ivan","role":"observer"})", root).status,
            204);
  restart_with(before);
  EXPECT_EQ(status_of(anna), 401);
  EXPECT_EQ(status_of(ivan), 401);
  EXPECT_EQ(status_of(root), 200);
}

TEST_F(KeptLogIns, ExpireWhileTheServerIsDown) {
  const std::string cookie = cookie_of("ivan");
  pass(seconds(3600.0));
  restart_with(text());
  EXPECT_EQ(status_of(cookie), 200) << "unused for one hour";
  const std::string kept = text();
  site_.reset();
  pass(seconds(2 * 3600.0));
  restart_with(kept);
  EXPECT_EQ(status_of(cookie), 401) << "unused for two hours";
}

TEST_F(KeptLogIns, EndAfterTwelveHoursHoweverOftenTheServerRestarts) {
  const std::string cookie = cookie_of("ivan");
  for (int hour = 1; hour < 12; ++hour) {
    pass(seconds(3600.0));
    restart();
    ASSERT_EQ(status_of(cookie), 200) << hour;
  }
  pass(seconds(3600.0));
  restart();
  EXPECT_EQ(status_of(cookie), 401);
}

TEST_F(KeptLogIns, AreNotProlongedByAClockThatIsSetBack) {
  const std::string cookie = cookie_of("ivan");
  site_.reset();
  passed_ns -= seconds(24 * 3600.0).ns;
  restart();
  EXPECT_EQ(status_of(cookie), 401);
}

TEST_F(KeptLogIns, ADamagedFileIsIgnoredWithAWarning) {
  const std::string cookie = cookie_of("ivan"), whole = text();
  for (const std::string& damaged :
       {std::string(), std::string("{"), std::string("[]"), std::string(R"({"sessions":[1]})"),
        std::string(R"({"sessions":[{"token":"x"}]})"), whole.substr(0, whole.size() / 2),
        std::string(2 << 20, ' ')}) {
    restart_with(damaged);
    EXPECT_EQ(status_of(cookie), 401);
    EXPECT_NE(site_->restore_fault().find(file().string()), std::string::npos) << site_->restore_fault();
    EXPECT_NE(audit().find(R"("what":"restore log-ins","outcome":"refused")"), std::string::npos);
    EXPECT_EQ(status_of(cookie_of("ivan")), 200) << "everybody can log in again";
  }
}

TEST_F(KeptLogIns, AFileThatOthersCanReadIsRefusedAndReplaced) {
  const std::string cookie = cookie_of("ivan");
  site_.reset();
  fs::permissions(file(), fs::perms::owner_all | fs::perms::group_read);
  restart();
  EXPECT_EQ(status_of(cookie), 401);
  EXPECT_NE(site_->restore_fault().find("other users can read or write it"), std::string::npos);
  const std::string again = cookie_of("ivan");
  EXPECT_EQ(fs::status(file()).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  restart();
  EXPECT_EQ(status_of(again), 200);
}

TEST_F(KeptLogIns, ALinkIsNotFollowed) {
  const std::string cookie = cookie_of("ivan");
  site_.reset();
  fs::rename(file(), folder_ / "elsewhere");
  fs::create_symlink(folder_ / "elsewhere", file());
  restart();
  EXPECT_EQ(status_of(cookie), 401);
  EXPECT_NE(site_->restore_fault().find("is a link"), std::string::npos) << site_->restore_fault();
}

TEST_F(KeptLogIns, OfALinkEndWithTheProcessEvenUnderTheNameOfAnAccount) {
  const std::string link = site_->link(station::Role::instructor, "ivan");
  const RawAnswer entered = RawClient(port_).get(link.substr(link.find("/enter")));
  ASSERT_EQ(entered.status, 303);
  EXPECT_EQ(RawClient(port_).get("/api/v1/me", cookie_in(entered)).body,
            R"({"name":"ivan_2","role":"instructor"})");
  restart();
  EXPECT_EQ(status_of(cookie_in(entered)), 401);
}

}  // namespace
}  // namespace parhelion::test
