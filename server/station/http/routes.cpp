#include "server/station/http/routes.hpp"

namespace parhelion::station {
namespace {

bool fits(const std::string& route, std::string_view path) {
  return route.back() == '/' ? path.substr(0, route.size()) == route : path == route;
}

}  // namespace

void Routes::add(Route route) { routes_.push_back(std::move(route)); }

Routes::Found Routes::find(std::string_view method, std::string_view path) const {
  std::size_t longest = 0;
  for (const Route& route : routes_) {
    if (fits(route.path, path)) longest = std::max(longest, route.path.size());
  }
  Found found;
  for (const Route& route : routes_) {
    if (route.path.size() != longest || !fits(route.path, path)) continue;
    found.methods += (found.methods.empty() ? "" : ", ") + route.method;
    if (route.method == method) found.route = &route;
  }
  return found;
}

}  // namespace parhelion::station
