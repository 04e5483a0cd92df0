// A complete base station beside a live server, over real sockets: permissions of each role, and isolation
// between pages.
#include "server/station/base_station.hpp"

#include <gmock/gmock.h>
#include <malloc.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "protocols/channels.hpp"
#include "server/runtime/loop.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/station/http/accounts.hpp"
#include "server/station/http/password.hpp"
#include "tests/server/station/http/raw_client.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::station {
namespace {

using Json = nlohmann::json;
using parhelion::test::RawAnswer;
using parhelion::test::RawClient;
using ::testing::HasSubstr;

constexpr const char* kPassword = "correct horse";

SiteTexture one_quad() {
  SiteTexture texture;
  texture.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  texture.quads = {{0, 1, 2, 3}};
  texture.looks = {QuadLook::recorded};
  texture.jpeg = {0xff, 0xd8};
  return texture;
}

class BaseStationTest : public ::testing::Test {
 protected:
  void SetUp() override {
    make_accounts();
    ASSERT_TRUE(witness_->subscribe("MR_.*", 10'000).ok());
    BaseStationOptions options;
    options.folder = folder_ / "site";
    options.plain = true;
    options.station.configuration = std::make_shared<const tick::Configuration>(configuration_);
    options.station.notes = folder_ / "notes.jsonl";
    options.station.scenarios = folder_ / "scenarios";
    options.station.texture = texture_;
    options.station.controls.end = [this] { return ended_ = true, Status(); };
    options.open_bus = [this] { return Result<std::unique_ptr<Bus>>(hub_.connect()); };
    auto opened = BaseStation::open(std::move(options));
    ASSERT_TRUE(opened) << opened.error().message;
    station_ = std::move(*opened);
    const std::string address = station_->address();
    port_ = static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));
  }
  void TearDown() override {
    station_.reset();
    stop_ = true;
    if (server_.joinable()) server_.join();
  }
  void make_accounts() {
    std::filesystem::create_directories(folder_ / "site");
    std::filesystem::permissions(folder_ / "site", std::filesystem::perms::owner_all);
    auto accounts = Accounts::open(folder_ / "site/accounts.json");
    const auto hash = hash_password(kPassword);
    ASSERT_TRUE(accounts && hash);
    for (const Role role : {Role::admin, Role::instructor, Role::trainee, Role::observer})
      ASSERT_TRUE((*accounts)->put(std::string(role_name(role)), role, *hash));
  }
  void serve_in_background() {
    server_ = std::thread([this] {
      runtime::ServeOptions options;
      options.stop = [this] { return stop_.load(); };
      EXPECT_TRUE(runtime::serve(*server_bus_, configuration_, options).ok());
    });
    for (Message message; message.channel != channel::kMrWorld;)
      ASSERT_TRUE(*witness_->receive(message, seconds(20)));
  }

  /// The cookie of the account that has its role as name.
  std::string cookie(const std::string& name) {
    const RawAnswer answer = RawClient(port_).post(
        "/api/v1/login", R"({"name":")" + name + R"(","password":")" + kPassword + "\"}");
    EXPECT_EQ(answer.status, 204) << name;
    const std::string header = answer.headers.at("set-cookie");
    return header.substr(0, header.find(';'));
  }
  std::unique_ptr<RawClient> open_client(const std::string& name, const std::string& path = "/ws/state") {
    auto client = std::make_unique<RawClient>(port_);
    EXPECT_EQ(client->open_socket(path, cookie(name)).status, 101) << name << " " << path;
    return client;
  }
  /// The next text of this type. Null: the page was closed.
  static Json next(RawClient& client, const std::string& type) {
    while (const auto frame = client.frame()) {
      if (frame->opcode == 8) break;
      if (frame->opcode != 1) continue;
      Json message = Json::parse(frame->payload);
      if (message["type"] == type) return message;
    }
    return nullptr;
  }
  static Json ask(RawClient& client, const std::string& text) {
    client.send_text(text);
    return next(client, "reply");
  }
  std::vector<InstructorCommand> commands() {
    std::vector<InstructorCommand> all;
    for (Message message; *witness_->receive(message, Duration{0});) {
      auto command = command_on(message.channel);
      if (!command) continue;
      EXPECT_TRUE(decode(message.channel, message.payload, *command).ok());
      all.push_back(std::move(*command));
    }
    return all;
  }
  std::string audit() { return RawClient(port_).get("/api/v1/audit", cookie("admin")).body; }

  test::TemporaryFolder folder_;
  tick::Configuration configuration_ = test::configuration({});
  std::shared_ptr<const SiteTexture> texture_ = std::make_shared<const SiteTexture>(one_quad());
  MemoryBusHub hub_;
  std::unique_ptr<Bus> server_bus_ = hub_.connect(), witness_ = hub_.connect();
  std::unique_ptr<BaseStation> station_;
  std::uint16_t port_ = 0;
  std::atomic<bool> ended_ = false, stop_ = false;
  std::thread server_;
};

TEST_F(BaseStationTest, InstructorRoutesAreRefusedToTraineesAndObservers) {
  serve_in_background();
  const std::vector<std::string> commands_of_instructors{
      R"({"type":"agent","request":1,"action":"spawn","name":"a","x":1,"y":1})",
      R"({"type":"agent","request":1,"action":"remove_all"})",
      R"({"type":"agent","request":1,"action":"unfreeze","name":"synthetic"})",
      R"({"type":"agent","request":1,"action":"door","name":"door 1","opening":1})",
      R"({"type":"script","request":1,"name":"s"})",
      R"({"type":"fault","request":1,"kind":"camera_loss","amount":1})",
      R"({"type":"end","request":1,"seen":0})",
      R"({"type":"save","request":1,"name":"mine"})",
      R"({"type":"mark","request":1,"text":"x"})",
      R"({"type":"control","request":1,"seen":0,"action":"pause"})",
      R"({"type":"control","request":1,"seen":0,"action":"seek","value":0})"};
  for (const std::string role : {"trainee", "observer"}) {
    const auto client = open_client(role);
    for (const std::string& text : commands_of_instructors) {
      const Json reply = ask(*client, text);
      EXPECT_EQ(reply["ok"], false) << role << text;
      EXPECT_THAT(reply["text"].get<std::string>(), HasSubstr(role + "s may not")) << text;
    }
    for (const char* path : {"/api/v1/accounts", "/api/v1/audit"})
      EXPECT_EQ(RawClient(port_).get(path, cookie(role)).status, 403) << role << path;
  }
  const auto observer = open_client("observer");
  for (const char* text : {R"({"type":"report","request":1,"name":"x"})",
                           R"({"type":"chat","request":1,"text":"x"})", R"({"type":"estop","request":1})"})
    EXPECT_EQ(ask(*observer, text)["ok"], false) << text;
  EXPECT_EQ(RawClient(port_).open_socket("/ws/teleop", cookie("observer")).status, 403);
  EXPECT_TRUE(commands().empty());
  EXPECT_FALSE(ended_);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "scenarios"));
  EXPECT_THAT(audit(), HasSubstr("observers may not do this: estop"));

  const auto instructor = open_client("instructor");
  EXPECT_EQ(ask(*instructor, commands_of_instructors[0])["ok"], true) << "it is no fault of the command";
  ASSERT_EQ(commands().size(), 1U);
}

TEST_F(BaseStationTest, AnInstructorStopsTheRobotThrough512IdleConnections) {
  serve_in_background();
  const std::string instructor = cookie("instructor");
  std::vector<std::unique_ptr<RawClient>> idle;
  for (int i = 0; i < 512; ++i) {
    idle.push_back(std::make_unique<RawClient>(port_));
    ASSERT_TRUE(idle.back()->connected()) << i;
  }
  RawClient page(port_);
  ASSERT_EQ(page.open_socket("/ws/state", instructor).status, 101);
  EXPECT_EQ(ask(page, R"({"type":"estop","request":1})")["ok"], true);
  EXPECT_EQ(cookie("trainee").empty(), false) << "others log in, too";
}

TEST_F(BaseStationTest, AnInstructorStopsTheRobotWhileSixtyOthersLogIn) {
  serve_in_background();
  RawClient page(port_);
  ASSERT_EQ(page.open_socket("/ws/teleop", cookie("instructor")).status, 101);
  std::vector<std::unique_ptr<RawClient>> crowd;
  for (int i = 0; i < 60; ++i) {
    crowd.push_back(std::make_unique<RawClient>(port_));
    const std::string body = R"({"name":"user)" + std::to_string(i) + R"(","password":"12345678"})";
    ASSERT_TRUE(crowd.back()->send_post("/api/v1/login", body));
  }
  ASSERT_TRUE(page.send_text(R"({"type":"stop"})"));
  EXPECT_EQ(next(page, "estop")["on"], true);
  RawClient elsewhere(port_, false, "127.0.0.2");
  EXPECT_EQ(elsewhere.post("/api/v1/login", R"({"name":"instructor","password":"correct horse"})").status,
            204);
}

TEST_F(BaseStationTest, InvalidOrExpiredCookiesOpenNoSocket) {
  const std::string over = cookie("instructor");
  EXPECT_EQ(RawClient(port_).post("/api/v1/logout", "", over).status, 204);
  const std::string made_up = over.substr(0, over.find('=') + 1) + std::string(43, 'A');
  for (const char* path : {"/ws/state", "/ws/teleop", "/ws/video"}) {
    for (const std::string& each : {std::string(), over, made_up})
      EXPECT_EQ(RawClient(port_).open_socket(path, each).status, 401) << path << each;
    EXPECT_EQ(RawClient(port_).open_socket_from("http://evil.example", path, cookie("instructor")).status,
              403)
        << path;
  }
  EXPECT_EQ(RawClient(port_).get("/video.mjpg").status, 401);
  EXPECT_EQ(RawClient(port_).get("/api/v1/model", over).status, 401);
}

TEST_F(BaseStationTest, MarkupInNamesAndMessagesStaysText) {
  serve_in_background();
  const std::string markup = R"(</script><script>alert(1)</script>)";
  const auto client = open_client("instructor");
  const Json spawn =
      ask(*client, R"({"type":"agent","request":1,"action":"spawn","x":1,"y":1,"name":")" + markup + "\"}");
  EXPECT_EQ(spawn["ok"], false) << "no name has such letters";
  const auto observer = open_client("observer");
  ask(*client, R"({"type":"chat","request":2,"text":")" + markup + "\"}");
  EXPECT_EQ(next(*observer, "chat")["text"], markup);
  const RawAnswer made = RawClient(port_).post(
      "/api/v1/accounts", R"({"name":")" + markup + R"(","role":"trainee","password":"12345678"})",
      cookie("admin"));
  EXPECT_EQ(made.status, 409);
  EXPECT_EQ(made.headers.at("content-type"), "application/json");
  EXPECT_EQ(made.headers.at("x-content-type-options"), "nosniff");
}

TEST_F(BaseStationTest, FilesAreCompressedAndPendingReportsAreAnnounced) {
  const std::string admin = cookie("admin");
  const RawAnswer model = RawClient(port_).get("/api/v1/model", admin, "Accept-Encoding: gzip\r\n");
  EXPECT_EQ(model.headers.at("content-encoding"), "gzip");
  EXPECT_LT(model.body.size(), RawClient(port_).get("/api/v1/model", admin).body.size());
  const std::string known = "If-None-Match: " + model.headers.at("etag") + "\r\n";
  EXPECT_EQ(RawClient(port_).get("/api/v1/model", admin, known).status, 304);
  EXPECT_THAT(RawClient(port_).get("/metrics").body, HasSubstr("parhelion_video_sent_total 0"));

  EXPECT_EQ(RawClient(port_).get("/api/v1/report", admin).status, 404);
  const std::string clock = std::to_string(Duration{runtime::steady_now().ns}.seconds());
  EXPECT_EQ(ask(*open_client("instructor"), R"({"type":"end","request":1,"seen":)" + clock + "}")["ok"],
            true);
  const RawAnswer soon = RawClient(port_).get("/api/v1/report", admin);
  EXPECT_EQ(soon.status, 503);
  EXPECT_EQ(soon.headers.at("retry-after"), "1");
  station_->set_report({R"({"score":1})",
                        "<html></html>",
                        R"({"score":2})",
                        "<html>his</html>",
                        {{"rover_2", {"<html>2</html>", "<html>his 2</html>"}}}});
  EXPECT_EQ(RawClient(port_).get("/api/v1/report", admin).body, R"({"score":1})");
  EXPECT_EQ(RawClient(port_).get("/report", admin).status, 200);
  const std::string trainee = cookie("trainee");
  EXPECT_EQ(RawClient(port_).get("/api/v1/report", trainee).body, R"({"score":2})");
  EXPECT_EQ(RawClient(port_).get("/report", trainee).body, "<html>his</html>");
  EXPECT_EQ(RawClient(port_).get("/report?rover_2", admin).body, "<html>2</html>");
  EXPECT_EQ(RawClient(port_).get("/report?rover_2", trainee).body, "<html>his 2</html>");
  EXPECT_EQ(RawClient(port_).get("/report?rover_3", admin).status, 404);
}

TEST_F(BaseStationTest, PagesGetTheRecordedSurfacesOfTheSite) {
  const std::string trainee = cookie("trainee");
  EXPECT_EQ(Json::parse(RawClient(port_).get("/api/v1/session", trainee).body)["session"]["textured"], true);
  const std::string body = RawClient(port_).get("/api/v1/texture", trainee).body;
  const auto texture = unpack_site_texture({reinterpret_cast<const std::uint8_t*>(body.data()), body.size()});
  ASSERT_TRUE(texture) << texture.error().message;
  EXPECT_EQ(texture->quads, texture_->quads);
  EXPECT_EQ(RawClient(port_).get("/api/v1/texture").status, 401);
}

/// MB of heap memory in use.
double heap() {
  const struct mallinfo2 use = mallinfo2();
  return static_cast<double>(use.uordblks + use.hblkhd) / 1e6;
}

TEST_F(BaseStationTest, APageThatNeverReadsDoesNotSlowOthers) {
  serve_in_background();
  const auto publisher = hub_.connect();
  const auto client = open_client("instructor");
  std::vector<std::uint8_t> payload;
  int number = 0;
  // Half a megabyte of in-order events to every page; this page reads them.
  const auto round = [&] {
    Event event;
    event.kind = EventKind::agent_spawned;
    event.text = std::string(20'000, 'x');
    for (int i = 0; i < 25; ++i) {
      event.stamp = {runtime::wall_now().ns};
      event.value = ++number;
      encode(event, payload);
      ASSERT_TRUE(publisher->publish(channel::kMrEvents, payload).ok());
    }
    commands();  // the witness discards them
    for (int last = 0; last < number;) {
      const Json events = next(*client, "events");
      ASSERT_FALSE(events.is_null()) << "the page that reads is not closed";
      for (const Json& each : events["list"]) last = std::max(last, each["value"].get<int>());
    }
  };
  for (int i = 0; i < 22; ++i) round();  // events that are stored for pages that connect later
  RawClient unresponsive(port_);
  const int little = 4096;
  setsockopt(unresponsive.descriptor(), SOL_SOCKET, SO_RCVBUF, &little, sizeof little);
  ASSERT_EQ(unresponsive.open_socket("/ws/state", cookie("observer")).status, 101);
  const double before = heap();
  for (int i = 0; i < 30; ++i) round();  // 15 MB
  EXPECT_LT(heap() - before, 8) << "MB; a page may let 4 wait";

  const auto robot = hub_.connect();
  ASSERT_TRUE(robot->subscribe(channel::kMrScan, 100).ok());
  for (int i = 0; i < 10; ++i) {
    const Message scan = test::message(channel::kScan, 0, test::scan_at(0.1 * i));
    ASSERT_TRUE(robot->publish(scan.channel, scan.payload).ok());
    Message answer;
    ASSERT_TRUE(*robot->receive(answer, seconds(20))) << "scan " << i;
  }
  // A client that reads at last receives the close frame.
  std::optional<RawClient::Frame> frame = unresponsive.frame();
  while (frame && frame->opcode != 8) frame = unresponsive.frame();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->code(), 1013);
}

}  // namespace
}  // namespace parhelion::station
