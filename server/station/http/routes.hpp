// Maps paths to handlers.
#pragma once

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "server/station/http/http_server.hpp"

namespace parhelion::station {

struct SocketRoute {
  SocketHandler handler;
  SocketTerms terms;
};
struct StreamRoute {
  SocketHandler handler;
  std::string content_type;
};

struct Route {
  std::string method, path;
  Access access;
  std::variant<HttpServer::Handler, HttpServer::LateHandler, SocketRoute, StreamRoute> target;
};

class Routes {
 public:
  void add(Route route);

  struct Found {
    const Route* route = nullptr;  ///< nullptr: none
    std::string methods;           ///< of the path, "GET, POST"; empty: no such path
  };
  Found find(std::string_view method, std::string_view path) const;

 private:
  std::vector<Route> routes_;
};

}  // namespace parhelion::station
