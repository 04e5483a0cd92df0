// Open WebSockets and picture streams.
#include <future>

#include "tests/server/station/http/site_fixture.hpp"

namespace parhelion::test {
namespace {

class Socket : public SiteTest {
 protected:
  void open_logged_in(station::HttpOptions http = {}) {
    make_accounts({{"anna", station::Role::trainee}});
    open(std::move(http));
    cookie_ = cookie_of("anna");
  }
  std::unique_ptr<RawClient> connect(const std::string& path = "/ws/echo") {
    auto client = std::make_unique<RawClient>(port());
    EXPECT_EQ(client->open_socket(path, cookie_).status, 101);
    return client;
  }
  std::string cookie_;
};

TEST_F(Socket, CarriesMessagesInBothDirections) {
  open_logged_in();
  const auto client = connect("/ws/echo?robot=big%20rover");
  client->send_text("text");
  auto frame = client->frame();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->opcode, 1);
  EXPECT_EQ(frame->payload, "text");
  client->send_frame(0x82, std::string(60'000, '\xff'));
  frame = client->frame();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->opcode, 2);
  EXPECT_EQ(frame->payload.size(), 60'000U);
  EXPECT_EQ(client_->who().name, "anna");
  EXPECT_EQ(station::query_value(client_->query(), "robot"), "big rover");
}

TEST_F(Socket, ClosesOnProtocolViolationsAndReportsTheReason) {
  open_logged_in();
  struct Offence {
    const char* what;
    int code;
    std::function<void(RawClient&)> commit;
  };
  const std::vector<Offence> offences = {
      {"too long", 1009, [](RawClient& c) { c.send_frame(0x81, std::string(65'537, 'x')); }},
      {"says to be enormous", 1009, [](RawClient& c) { c.send_frame(0x82, "x", std::uint64_t{1} << 62U); }},
      {"too long in parts", 1009,
       [](RawClient& c) {
         c.send_frame(0x01, std::string(40'000, 'x'));
         c.send_frame(0x80, std::string(40'000, 'x'));
       }},
      {"not masked", 1002, [](RawClient& c) { c.send_frame(0x81, "x", {}, false); }},
      {"reserved bits", 1002, [](RawClient& c) { c.send_frame(0xf1, "x"); }},
      {"unknown opcode", 1002, [](RawClient& c) { c.send_frame(0x83, "x"); }},
      {"goes on with nothing", 1002, [](RawClient& c) { c.send_frame(0x80, "x"); }},
      {"ping too long", 1002, [](RawClient& c) { c.send_frame(0x89, std::string(126, 'x')); }},
      {"not UTF-8", 1007, [](RawClient& c) { c.send_frame(0x81, "\xc3\x28"); }},
      {"closing code that is none", 1002,
       [](RawClient& c) { c.send_frame(0x88, std::string("\x03\xe7", 2)); }},
  };
  for (const Offence& offence : offences) {
    const auto client = connect();
    offence.commit(*client);
    const auto frame = client->frame();
    ASSERT_TRUE(frame) << offence.what;
    EXPECT_EQ(frame->opcode, 8) << offence.what;
    EXPECT_EQ(frame->code(), offence.code) << offence.what;
  }
  // The server continues, and it is recorded.
  const auto client = connect();
  client->send_text("still there");
  EXPECT_EQ(client->frame()->payload, "still there");
  EXPECT_NE(
      audit().find(R"("who":"anna","from":"127.0.0.1","what":"message on /ws/echo","outcome":"refused")"),
      std::string::npos);
}

TEST_F(Socket, OpensOnlyAfterAHandshake) {
  open_logged_in();
  EXPECT_EQ(RawClient(port())
                .get("/ws/echo", cookie_, "Origin: http://127.0.0.1:" + std::to_string(port()) + "\r\n")
                .status,
            426);
  EXPECT_EQ(RawClient(port()).open_socket("/healthz", cookie_).status, 400);
  EXPECT_EQ(RawClient(port()).open_socket("/ws/nothing", cookie_).status, 404);
  EXPECT_EQ(opened, 0);
}

TEST_F(Socket, SendsASlowClientOnlyTheNewestMessage) {
  open_logged_in();
  const auto client = connect();
  client->send_text("here");
  ASSERT_EQ(client->frame()->payload, "here");
  const int last = 2000;
  for (int i = 0; i <= last; ++i) {
    client_->send(std::make_shared<const std::string>(std::string(20'000, 'x') + std::to_string(i)), true, 0);
  }
  client_->send(std::make_shared<const std::string>("the end"), false);
  EXPECT_LT(client_->waiting_bytes(), 200'000U);
  int pictures = 0;
  std::string newest;
  for (auto frame = client->frame(); frame && frame->payload != "the end"; frame = client->frame()) {
    ++pictures;
    newest = frame->payload.substr(20'000);
  }
  EXPECT_EQ(newest, std::to_string(last));
  EXPECT_LT(pictures, last) << "those that waited were replaced";
}

TEST_F(Socket, ClosesAClientWithTooManyQueuedMessages) {
  open_logged_in({.waiting_bytes = 100'000});
  const auto client = connect();
  client->send_text("here");
  ASSERT_EQ(client->frame()->payload, "here");
  // Far more than the kernel buffers, while the client does not read.
  const auto message = std::make_shared<const std::string>(std::string(50'000, 'x'));
  for (int i = 0; i < 1000; ++i) client_->send(message, true);
  std::optional<RawClient::Frame> frame;
  do {
    frame = client->frame();
  } while (frame && frame->opcode != 8);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->code(), 1013);
  EXPECT_EQ(client_->waiting_bytes(), 0U);
}

TEST_F(Socket, ClosesWhenThePeerStopsReading) {
  open_logged_in({.write_time = milliseconds(100)});
  const auto client = connect();
  client->send_text("here");
  ASSERT_EQ(client->frame()->payload, "here");
  client_->send(std::make_shared<const std::string>(std::string(16'000'000, 'x')), true, 0);
  std::promise<void> gone;
  while (closed == 0) std::this_thread::yield();
  EXPECT_EQ(client_->waiting_bytes(), 0U);
  EXPECT_NE(audit().find("does not read any more"), std::string::npos);
}

TEST_F(Socket, SendingAfterCloseOrServerEndIsSafe) {
  open_logged_in();
  {
    const auto client = connect();
    client->send_text("here");
    client->frame();
  }
  while (closed == 0) std::this_thread::yield();
  client_->send(std::make_shared<const std::string>("too late"), false);
  client_->close(1000, "bye");
  const auto other = connect();
  other->send_text("here");
  other->frame();
  site_.reset();
  EXPECT_EQ(closed, 2);
  client_->send(std::make_shared<const std::string>("much too late"), false);
  client_->close(1000, "bye");
}

TEST_F(Socket, ClosesWithTheGivenCodeAndReason) {
  open_logged_in();
  const auto client = connect();
  client->send_text("here");
  client->frame();
  client_->close(4001, std::string(300, 'y'));
  const auto frame = client->frame();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->code(), 4001);
  EXPECT_LE(frame->payload.size(), 125U);
}

TEST_F(Socket, SelectsACommonSubprotocolAndAllowsProgramsWhereConfigured) {
  auto server = station::HttpServer::open({});
  ASSERT_TRUE(server);
  (*server)->on_socket(
      "/", station::Access::everyone(), {},
      {.protocols = {"second.v2", "first.v1"}, .programs = true, .origins = {"https://app.example"}});
  (*server)->run();
  const auto ask = [&](const std::string& origin, const std::string& more) {
    return RawClient((*server)->port()).open_socket_from(origin, "/", "", more);
  };
  const std::string offered = "Sec-WebSocket-Protocol: first.v1, second.v2\r\n";
  const RawAnswer both = ask("https://app.example", offered);
  EXPECT_EQ(both.status, 101);
  EXPECT_EQ(both.headers.at("sec-websocket-protocol"), "second.v2");
  for (const char* origin : {"file://", "http://127.0.0.1:8080", "https://127.0.0.1"})
    EXPECT_EQ(ask(origin, offered).status, 101) << origin;
  for (const char* origin :
       {"https://elsewhere.example", "null", "http://192.0.2.1", "https://app.example.evil",
        "http://127.0.0.1.evil", "file:///", "http://127.0.0.1:8080/"})
    EXPECT_EQ(ask(origin, offered).status, 403) << origin;
  EXPECT_EQ(ask("https://app.example", "Sec-WebSocket-Protocol: other\r\n").status, 400);
  EXPECT_EQ(ask("https://app.example", "").status, 400);
}

TEST_F(Socket, StreamsWriteBytesUnchanged) {
  auto server = station::HttpServer::open({});
  ASSERT_TRUE(server);
  std::promise<std::shared_ptr<station::WebClient>> opened_stream;
  std::promise<void> left;
  (*server)->on_stream(
      "/video", station::Access::everyone(), "multipart/x-mixed-replace; boundary=frame",
      {.opened = [&](std::shared_ptr<station::WebClient> c) { opened_stream.set_value(std::move(c)); },
       .closed = [&](station::WebClient&) { left.set_value(); }});
  (*server)->run();
  {
    RawClient viewer((*server)->port());
    const RawAnswer head = viewer.get("/video?robot=rover");
    EXPECT_EQ(head.status, 200);
    EXPECT_EQ(head.headers.at("content-type"), "multipart/x-mixed-replace; boundary=frame");
    const auto stream = opened_stream.get_future().get();
    EXPECT_EQ(stream->query(), "robot=rover");
    stream->send(std::make_shared<const std::string>("--frame\r\n\r\nabc"), true, 0);
    EXPECT_EQ(viewer.take(14), "--frame\r\n\r\nabc");
  }
  left.get_future().get();
}

}  // namespace
}  // namespace parhelion::test
