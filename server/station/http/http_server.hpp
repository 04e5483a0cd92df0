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

/// A request that was refused before it reached a handler.
struct WebRefusal {
  std::string remote, who;  ///< who: empty if nobody is logged in
  std::string what;         ///< method and path, or a description; untrusted text of the peer: escape it
  std::string why;
  int status = 0;  ///< 0: the connection was closed without a response
};

/// Current load of an open server.
struct HttpCounts {
  std::uint64_t connections = 0, clients = 0;  ///< now
  std::uint64_t accepted = 0, requests = 0, refused = 0, sent_bytes = 0, received_bytes = 0, replaced = 0;
};

struct HttpOptions {
  std::string address = "127.0.0.1";  ///< of an interface; "::" and "0.0.0.0": all
  std::uint16_t port = 0;             ///< 0: any free port
  /// PEM files. Both empty: plain HTTP, refused for an address that other machines can reach.
  std::string certificate = {}, key = {};
  bool open_to_all = false;  ///< plain HTTP on any address: for servers without log-in
  /// Host names, besides addresses, localhost and this machine's own, that requests may use (protects against
  /// DNS rebinding).
  std::vector<std::string> names = {};

  /// Identity of this session token; nullopt: none (any more). Called on the server's thread for each
  /// request, and once a second for each open client, which counts as use.
  std::function<std::optional<Identity>(const std::string& session)> identify = {};
  std::function<void(const WebRefusal&)> refused = {};  ///< on the server's thread; may be empty

  std::size_t header_bytes = 16 * 1024;
  std::size_t body_bytes = 64 * 1024;           ///< of a request
  std::size_t message_bytes = 64 * 1024;        ///< of a received WebSocket message
  std::size_t waiting_bytes = 4 * 1024 * 1024;  ///< in-order bytes in the queue of one client before it is
                                                ///< closed
  std::size_t connections = 512;                ///< in all
  /// Of these, at most so many of peers that have not logged in; the others are reserved for those who have.
  /// At each limit a connection without a log-in is closed for a newer one.
  std::size_t strangers = 256;
  std::size_t connections_per_address = 128;  ///< this machine's own are not bounded by it
  Duration request_time = seconds(10.0);      ///< for the handshake, and for a whole request to come in
  Duration idle_time = seconds(30.0);   ///< between two requests; a silent WebSocket is pinged, then closed
  Duration write_time = seconds(15.0);  ///< for the peer to accept a response or a message
};

struct SocketTerms {
  /// Supported subprotocols; the first one that the client offers is used, and it must offer one. Empty: no
  /// negotiation.
  std::vector<std::string> protocols = {};
  /// Programs may open it, too: those that send no Origin, or that of a file, pages of this machine on other
  /// ports, and pages of `origins`, such as "https://app.example".
  bool programs = false;
  std::vector<std::string> origins = {};
};

class HttpServer {
 public:
  /// Binds and listens. Connections wait until run(). The error describes which option does not work on this
  /// machine.
  static Result<std::unique_ptr<HttpServer>> open(HttpOptions options);
  ~HttpServer();

  using Handler = std::function<HttpResponse(const HttpRequest&)>;
  using Answer = std::function<void(HttpResponse)>;
  using LateHandler = std::function<void(const HttpRequest&, Answer)>;

  /// Call before run(). `path`: exact, or a prefix if it ends in '/'; the longest match wins. Handlers run on
  /// the server's one thread and must not block.
  void on(std::string method, std::string path, Access access, Handler handler);
  /// For slow handlers: `Answer` may be called from any thread, once; if it is never called, the response is
  /// 503.
  void on_late(std::string method, std::string path, Access access, LateHandler handler);
  void on_socket(std::string path, Access access, SocketHandler handler, SocketTerms terms = {});
  /// GET with an endless response: sent messages are its body, unchanged (for multipart/x-mixed-replace).
  void on_stream(std::string path, Access access, std::string content_type, SocketHandler handler);

  /// Starts the server's thread. Call once.
  void run();
  /// Closes everything; handlers are notified, and not called any more afterwards. The destructor calls it,
  /// too.
  void stop();
  /// Runs `task` on the server's thread. Thread-safe.
  void post(std::function<void()> task);

  std::uint16_t port() const;
  bool encrypted() const;
  /// "parhelion-<port>", with "__Host-" before it if encrypted: browsers share cookies between ports.
  const std::string& cookie_name() const;
  HttpCounts counts() const;

 private:
  struct Implementation;
  explicit HttpServer(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace parhelion::station
