// A web site for a test: folder, clock, accounts, a WebSocket that echoes.
#pragma once

#include <atomic>
#include <filesystem>

#include "server/runtime/wall_clock.hpp"
#include "server/station/http/accounts.hpp"
#include "server/station/http/password.hpp"
#include "server/station/http/web_site.hpp"
#include "tests/server/station/http/raw_client.hpp"

namespace parhelion::test {

class SiteTest : public ::testing::Test {
 protected:
  static constexpr const char* kPassword = "correct horse";

  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("parhelion_site_" + std::to_string(getpid()) + "_" +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
  }
  void TearDown() override {
    site_.reset();
    std::filesystem::remove_all(folder_);
  }

  /// Accounts of the given names, each with `password`.
  void make_accounts(const std::vector<station::Identity>& all) {
    std::filesystem::create_directory(folder_);
    auto accounts = station::Accounts::open(folder_ / "accounts.json");
    ASSERT_TRUE(accounts) << accounts.error().message;
    const auto hash = station::hash_password(kPassword);
    ASSERT_TRUE(hash);
    ASSERT_TRUE((*accounts)->put("root", station::Role::admin, *hash));
    for (const station::Identity& who : all) ASSERT_TRUE((*accounts)->put(who.name, who.role, *hash));
  }

  void open(station::HttpOptions http = {}, bool plain = true) {
    station::WebSiteOptions options{.http = std::move(http), .folder = folder_, .plain = plain};
    options.steady = [this] { return WallTime{now_ns.load()}; };
    options.clock = [this] { return runtime::wall_now() + Duration{passed_ns.load()}; };
    auto site = station::WebSite::open(std::move(options));
    ASSERT_TRUE(site) << site.error().message;
    site_ = *std::move(site);
    const station::SocketHandler echo{
        .opened =
            [this](std::shared_ptr<station::WebClient> client) { ++opened, client_ = std::move(client); },
        .received = [](station::WebClient& client, std::string_view bytes,
                       bool binary) { client.send(std::make_shared<const std::string>(bytes), binary); },
        .closed = [this](station::WebClient&) { ++closed; }};
    site_->server().on_socket("/ws/echo", station::Access::logged_in(), echo);
    site_->server().on_socket("/ws/desk",
                              station::Access::only({station::Role::instructor, station::Role::admin}), echo);
    site_->server().on(
        "GET", "/desk", station::Access::only({station::Role::instructor, station::Role::admin}),
        [](const station::HttpRequest&) { return station::HttpResponse{.status = 200, .body = "{}"}; });
    site_->run();
  }

  std::uint16_t port() const { return site_->server().port(); }
  void pass(Duration time) {
    now_ns += time.ns;
    passed_ns += time.ns;
  }

  RawAnswer log_in(const std::string& name, const std::string& with) {
    return RawClient(port()).post("/api/v1/login",
                                  R"({"name":")" + name + R"(","password":")" + with + "\"}");
  }
  /// "name=value" of the cookie set by a log-in.
  std::string cookie_of(const std::string& name) {
    const RawAnswer answer = log_in(name, kPassword);
    EXPECT_EQ(answer.status, 204) << answer.body;
    return cookie_in(answer);
  }
  static std::string cookie_in(const RawAnswer& answer) {
    const auto header = answer.headers.find("set-cookie");
    return header == answer.headers.end() ? "" : header->second.substr(0, header->second.find(';'));
  }
  /// The audit log so far.
  std::string audit() {
    site_->audit().flush();
    std::string all;
    for (const std::string& line : site_->audit().newest(1000)) all += line + "\n";
    return all;
  }

  std::filesystem::path folder_;
  std::unique_ptr<station::WebSite> site_;
  std::shared_ptr<station::WebClient> client_;  ///< the last one opened
  std::atomic<int> opened{0}, closed{0};
  std::atomic<std::int64_t> now_ns{1'000'000'000'000}, passed_ns{0};
};

}  // namespace parhelion::test
