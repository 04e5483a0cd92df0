// HTTP(S) and WebSocket on one port. http_server.cpp is the only source that names Boost.Beast.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "protocols/time.hpp"
#include "server/station/http/http_message.hpp"
#include "server/station/http/web_client.hpp"

namespace parhelion::station {

/// What was turned away before any handler saw it.
struct WebRefusal {
  std::string remote, who;  ///< who: empty where nobody is logged in
  std::string what;         ///< method and path, or what was tried; text of the other end: escape it
  std::string why;
  int status = 0;  ///< 0: the connection was closed without an answer
};

/// How an open server stands.
struct HttpCounts {
  std::uint64_t connections = 0, clients = 0;  ///< now
  std::uint64_t accepted = 0, requests = 0, refused = 0, sent_bytes = 0, received_bytes = 0, replaced = 0;
};

struct HttpOptions {
  std::string address = "127.0.0.1";  ///< of an interface; "::" and "0.0.0.0": all
  std::uint16_t port = 0;             ///< 0: any that is free
  /// PEM files. Both empty: plain HTTP, refused for an address that others can reach.
  std::string certificate = {}, key = {};
  bool open_to_all = false;  ///< plain HTTP on any address: for servers that ask nobody who they are
  /// Host names, besides addresses, localhost and this machine's own, under which the server may be asked for
  /// (a name that an attacker lets point here is not one of them).
  std::vector<std::string> names = {};

  /// Who has this session token; nullopt: nobody (any more). Called on the server's thread for each request,
  /// and once a second for each open client, which counts as use.
  std::function<std::optional<Identity>(const std::string& session)> identify = {};
  std::function<void(const WebRefusal&)> refused = {};  ///< on the server's thread; may be empty

  std::size_t header_bytes = 16 * 1024;
  std::size_t body_bytes = 64 * 1024;           ///< of a request
  std::size_t message_bytes = 64 * 1024;        ///< of a WebSocket message that comes in
  std::size_t waiting_bytes = 4 * 1024 * 1024;  ///< in order, for one client, before it is closed
  std::size_t connections = 512;                ///< in all
  std::size_t connections_per_address = 128;    ///< this machine's own are only bounded by the above
  Duration request_time = seconds(10.0);        ///< for the handshake, and for a whole request to come in
  Duration idle_time = seconds(30.0);   ///< between two requests; a silent WebSocket is pinged, then closed
  Duration write_time = seconds(15.0);  ///< for the other end to take an answer or a message
};

struct SocketTerms {
  /// Subprotocols; the first that the client offers is taken, and it must offer one. Empty: none is asked
  /// for.
  std::vector<std::string> protocols = {};
  bool any_origin = false;  ///< pages of other sites may open it, too
};

class HttpServer {
 public:
  /// Binds and listens. Connections wait until run(). Error: says what of the options does not work here.
  static Result<std::unique_ptr<HttpServer>> open(HttpOptions options);
  ~HttpServer();

  using Handler = std::function<HttpResponse(const HttpRequest&)>;
  using Answer = std::function<void(HttpResponse)>;
  using LateHandler = std::function<void(const HttpRequest&, Answer)>;

  /// Before run(). `path`: exactly, or all below where it ends in '/'; the longest that fits is taken.
  /// Handlers run on the server's one thread and must not block.
  void on(std::string method, std::string path, Access access, Handler handler);
  /// For what takes long: `Answer` may be called from any thread, once; never calling it answers 503.
  void on_late(std::string method, std::string path, Access access, LateHandler handler);
  void on_socket(std::string path, Access access, SocketHandler handler, SocketTerms terms = {});
  /// GET answers without an end: what is sent is the body, as it is (for multipart/x-mixed-replace).
  void on_stream(std::string path, Access access, std::string content_type, SocketHandler handler);

  /// Starts the server's thread. Once.
  void run();
  /// Closes everything; handlers are told, and not called any more afterwards. The destructor does it, too.
  void stop();
  /// Runs `task` on the server's thread. Thread-safe.
  void post(std::function<void()> task);

  std::uint16_t port() const;
  bool encrypted() const;
  /// "parhelion-<port>", "__Host-" before it where encrypted: cookies do not tell ports apart.
  const std::string& cookie_name() const;
  HttpCounts counts() const;

 private:
  struct Implementation;
  explicit HttpServer(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace parhelion::station
