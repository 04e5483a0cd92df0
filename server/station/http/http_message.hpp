// A checked request and its response.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/station/http/identity.hpp"

namespace parhelion::station {

struct HttpRequest {
  std::string method;  ///< "GET" (a HEAD request, too), "POST", "DELETE"
  std::string path;    ///< decoded; begins with '/'; no "..", no control character
  std::string query;   ///< text after '?', as sent
  std::string body;
  std::string remote;           ///< address of the peer
  bool local = false;           ///< from this machine
  std::optional<Identity> who;  ///< nullopt: not logged in
  std::string session;          ///< the log-in cookie's value; empty: none
  std::string content_type, if_none_match, accept_encoding;
};

struct HttpResponse {
  int status = 200;
  std::string type = "application/json";
  std::string body = {};
  /// Other headers are added: length and security headers (a Content-Security-Policy here replaces the
  /// default). Without a Cache-Control the response is not cached.
  std::vector<std::pair<std::string, std::string>> headers = {};
  /// In place of `body`, if several responses share it.
  std::shared_ptr<const std::string> shared_body = nullptr;
};

/// {"error": message}, the body of every refusal.
HttpResponse refusal(int status, std::string_view message);

/// The decoded value of `key` in a query; nullopt: not there, or badly encoded.
std::optional<std::string> query_value(std::string_view query, std::string_view key);

/// nullopt: '%' without two hex digits.
std::optional<std::string> percent_decoded(std::string_view text);

/// The value of cookie `name` in a Cookie header; empty: missing. Of several, the first (RFC 6265).
std::string cookie_value(std::string_view header, std::string_view name);

/// As a JSON string with quotes; invalid UTF-8 becomes U+FFFD.
std::string json_text(std::string_view text);

}  // namespace parhelion::station
