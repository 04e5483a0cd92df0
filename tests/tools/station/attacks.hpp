// Attacks on a base station's port; each expects to be refused.
#pragma once

#include <nlohmann/json.hpp>

#include "server/runtime/wall_clock.hpp"
#include "tests/server/station/http/raw_client.hpp"

namespace parhelion::attack {

using Json = nlohmann::json;
using test::RawClient;

inline const std::string kMarkup = "</script><script>alert(1)</script>";

/// One attacker's client. Each has its own address, which the audit log contains.
class Attacker {
 public:
  Attacker(std::uint16_t port, std::string address) : port_(port), address_(std::move(address)) {}

  RawClient client() const { return RawClient(port_, false, address_.c_str()); }
  int get(const std::string& path, const std::string& cookie = "", const std::string& more = "") const {
    return client().get(path, cookie, more).status;
  }
  int post(const std::string& path, const std::string& body, const std::string& cookie = "") const {
    return client().post(path, body, cookie).status;
  }
  int open(const std::string& path, const std::string& cookie = "") const {
    return client().open_socket(path, cookie).status;
  }
  std::string own_origin() const { return client().origin(); }

 private:
  std::uint16_t port_;
  std::string address_;
};

/// The closing code after `commit`; 0: closed without one.
inline int closed_after(const Attacker& attacker, const std::string& path, const std::string& cookie,
                        const std::function<void(RawClient&)>& commit) {
  RawClient client = attacker.client();
  EXPECT_EQ(client.open_socket(path, cookie).status, 101) << path;
  commit(client);
  auto frame = client.frame();
  while (frame && frame->opcode != 8) frame = client.frame();
  return frame ? frame->code() : 0;
}

/// The reply to a page's request.
inline Json reply(RawClient& client, const std::string& text) {
  client.send_text(text);
  while (const auto frame = client.frame()) {
    if (frame->opcode == 8) break;
    if (frame->opcode != 1) continue;
    Json message = Json::parse(frame->payload);
    if (message["type"] == "reply") return message;
  }
  return Json::object();
}

struct Cookies {
  std::string admin, instructor, trainee, observer, over;
};
inline void without_a_cookie(const Attacker& attacker, const Cookies&) {
  for (const char* path : {"/api/v1/model", "/api/v1/accounts", "/api/v1/audit", "/video.mjpg"})
    EXPECT_EQ(attacker.get(path), 401) << path;
  for (const char* path : {"/ws/state", "/ws/teleop", "/ws/video"})
    EXPECT_EQ(attacker.open(path), 401) << path;
}

inline void with_anothers_role(const Attacker& attacker, const Cookies& cookies) {
  for (const std::string& cookie : {cookies.trainee, cookies.observer}) {
    EXPECT_EQ(attacker.get("/api/v1/accounts", cookie), 403);
    EXPECT_EQ(attacker.get("/api/v1/audit", cookie), 403);
    EXPECT_EQ(attacker.post("/api/v1/accounts", R"({"name":"trainee","role":"admin"})", cookie), 403);
  }
  EXPECT_EQ(attacker.open("/ws/teleop", cookies.observer), 403);
}

inline void with_a_cookie_that_is_over(const Attacker& attacker, const Cookies& cookies) {
  const std::string made_up = cookies.over.substr(0, cookies.over.find('=') + 1) + std::string(43, 'A');
  for (const std::string& cookie :
       {cookies.over, made_up, cookies.trainee.substr(0, cookies.trainee.size() - 1)}) {
    EXPECT_EQ(attacker.get("/api/v1/model", cookie), 401) << cookie;
    EXPECT_EQ(attacker.open("/ws/teleop", cookie), 401) << cookie;
  }
}

inline void from_another_site(const Attacker& attacker, const Cookies& cookies) {
  for (const std::string& origin : {std::string(), std::string("null"), std::string("http://evil.example"),
                                    attacker.own_origin() + "0"}) {
    for (const char* path : {"/ws/state", "/ws/teleop", "/ws/video"})
      EXPECT_EQ(attacker.client().open_socket_from(origin, path, cookies.instructor).status, 403) << origin;
    EXPECT_EQ(attacker.client().post_from(origin, "/api/v1/logout", "", cookies.instructor).status, 403)
        << origin;
  }
  RawClient rebound = attacker.client();
  rebound.send("GET /healthz HTTP/1.1\r\nHost: evil.example\r\n\r\n");
  EXPECT_EQ(rebound.answer().status, 421);
}

inline void with_broken_and_enormous_frames(const Attacker& attacker, const Cookies& cookies) {
  const std::pair<int, std::function<void(RawClient&)>> offences[] = {
      {1009, [](RawClient& c) { c.send_frame(0x82, "x", std::uint64_t{1} << 62U); }},
      {1009, [](RawClient& c) { c.send_frame(0x81, std::string(65'537, 'x')); }},
      {1002, [](RawClient& c) { c.send_frame(0x81, "x", {}, false); }},
      {1002, [](RawClient& c) { c.send_frame(0xf1, "x"); }},
      {1007, [](RawClient& c) { c.send_frame(0x81, "\xc3\x28"); }}};
  for (const char* path : {"/ws/state", "/ws/teleop", "/ws/video"})
    for (const auto& [code, commit] : offences)
      EXPECT_EQ(closed_after(attacker, path, cookies.trainee, commit), code) << path;
}

inline void with_malformed_messages(const Attacker& attacker, const std::string& path,
                                    const Cookies& cookies) {
  const int code = closed_after(attacker, path, cookies.trainee, [](RawClient& client) {
    for (int i = 0; i < 2000; ++i)
      client.send_text(i % 2 == 0 ? std::string(500, '[') : R"({"type":"twist"})");
  });
  EXPECT_EQ(code, 1008) << path;
}

inline void with_requests_too_long(const Attacker& attacker, const Cookies&) {
  EXPECT_EQ(attacker.get("/healthz", "", "X-Long: " + std::string(20'000, 'x') + "\r\n"), 431);
  EXPECT_EQ(attacker.post("/api/v1/login", std::string(70'000, 'x')), 413);
  RawClient rubbish = attacker.client();
  rubbish.send("POST /api/v1/login HTTP/1.1\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n");
  EXPECT_EQ(rubbish.answer().status, 400);
}

inline void with_ten_thousand_passwords(const Attacker& attacker, const Cookies&) {
  RawClient client = attacker.client();
  int hashed = 0, held = 0;
  for (int i = 0; i < 10'000; ++i) {
    const std::string guess = R"({"name":"admin","password":"guess )" + std::to_string(i) + "\"}";
    const int status = client.post("/api/v1/login", guess).status;
    hashed += status == 401;
    held += status == 429;
  }
  EXPECT_LE(hashed, 10);
  EXPECT_EQ(hashed + held, 10'000);
}

inline void with_paths_out_of_the_page(const Attacker& attacker, const Cookies& cookies) {
  for (const char* path : {"/../accounts.json", "/assets/../../accounts.json", "/%2e%2e/accounts.json",
                           "/..%5caccounts.json", "/a%00b", "/a%0d%0aSet-Cookie:x", "/%zz"})
    EXPECT_EQ(attacker.get(path, cookies.trainee), 400) << path;
  EXPECT_EQ(attacker.get("/accounts.json", cookies.trainee), 404);
}

inline void expect_forbidden(RawClient& client, const std::string& text) {
  const Json answer = reply(client, text);
  EXPECT_EQ(answer.value("ok", true), false) << text;
  EXPECT_NE(answer.value("text", "").find("s may not "), std::string::npos) << answer;
}

inline void as_a_trainee_who_instructs(const Attacker& attacker, const Cookies& cookies) {
  for (const std::string& cookie : {cookies.trainee, cookies.observer}) {
    RawClient client = attacker.client();
    ASSERT_EQ(client.open_socket("/ws/state", cookie).status, 101);
    for (const char* text :
         {R"({"type":"agent","request":1,"action":"spawn","name":"a","x":1,"y":1})",
          R"({"type":"agent","request":1,"action":"remove_all"})", R"({"type":"end","request":1,"seen":0})"})
      expect_forbidden(client, text);
    // The clock is the one that the server shows its pages.
    const std::string now = std::to_string(Duration{runtime::steady_now().ns}.seconds());
    expect_forbidden(client, R"({"type":"estop_release","request":1,"seen":)" + now + "}");
  }
}

inline void with_script_in_names(const Attacker& attacker, const Cookies& cookies) {
  EXPECT_EQ(
      attacker.post("/api/v1/accounts",
                    R"({"name":")" + kMarkup + R"(","role":"trainee","password":"12345678"})", cookies.admin),
      409);
  EXPECT_EQ(attacker.post("/api/v1/login", R"({"name":")" + kMarkup + R"(","password":"12345678"})"), 401);
  RawClient client = attacker.client();
  ASSERT_EQ(client.open_socket("/ws/state", cookies.trainee).status, 101);
  const Json answer = reply(client, R"({"type":")" + kMarkup + R"(","request":1})");
  EXPECT_EQ(answer.value("ok", true), false) << answer;
}

}  // namespace parhelion::attack
