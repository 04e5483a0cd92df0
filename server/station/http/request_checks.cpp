#include "server/station/http/request_checks.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <array>

#include "server/station/http/http_message.hpp"

namespace parhelion::station {
namespace {

std::string lower(std::string_view text) {
  std::string low(text);
  for (char& c : low) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return low;
}

bool control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

bool is_address(const std::string& host) {
  std::array<unsigned char, 16> bytes{};
  return inet_pton(AF_INET, host.c_str(), bytes.data()) == 1 ||
         inet_pton(AF_INET6, host.c_str(), bytes.data()) == 1;
}

bool is_port(std::string_view text) {
  return !text.empty() && text.size() <= 5 &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

std::optional<RequestTarget> parse_target(std::string_view target) {
  const std::size_t question = target.find('?');
  const std::optional<std::string> path = percent_decoded(target.substr(0, question));
  if (!path || path->empty() || path->front() != '/') return std::nullopt;
  if (path->find("..") != std::string::npos || path->find('\\') != std::string::npos) return std::nullopt;
  if (std::any_of(path->begin(), path->end(), control)) return std::nullopt;
  RequestTarget parsed{*path, ""};
  if (question != std::string_view::npos) parsed.query = target.substr(question + 1);
  return parsed;
}

std::string host_name(std::string_view authority) {
  std::string_view host = authority, rest;
  if (!authority.empty() && authority.front() == '[') {
    const std::size_t end = authority.find(']');
    if (end == std::string_view::npos) return "";
    host = authority.substr(1, end - 1);
    rest = authority.substr(end + 1);
  } else if (const std::size_t colon = authority.find(':'); colon != std::string_view::npos) {
    host = authority.substr(0, colon);
    rest = authority.substr(colon);
  }
  if (!rest.empty() && (rest.front() != ':' || !is_port(rest.substr(1)))) return "";
  return lower(host);
}

HostNames::HostNames(const std::vector<std::string>& names) : names_{"localhost"} {
  for (const std::string& name : names) names_.push_back(lower(name));
}

bool HostNames::knows(std::string_view host_header) const {
  const std::string host = host_name(host_header);
  return is_address(host) || std::find(names_.begin(), names_.end(), host) != names_.end();
}

bool same_origin(std::string_view origin, std::string_view host, bool encrypted) {
  return !host.empty() && lower(origin) == (encrypted ? "https://" : "http://") + lower(host);
}

bool program_origin(std::string_view origin, std::string_view host, const std::vector<std::string>& origins) {
  const std::string asked = lower(origin);
  if (asked.empty() || asked == "file://") return true;
  if (std::any_of(origins.begin(), origins.end(),
                  [&](const std::string& each) { return lower(each) == asked; }))
    return true;
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (!asked.starts_with(scheme)) continue;
    const std::string name = host_name(std::string_view(asked).substr(scheme.size()));
    return !name.empty() && name == host_name(host);
  }
  return false;
}

std::string network_of(const std::string& address) {
  std::array<unsigned char, 16> bytes{};
  if (inet_pton(AF_INET6, address.c_str(), bytes.data()) != 1) return address;
  std::fill(bytes.begin() + 8, bytes.end(), static_cast<unsigned char>(0));
  std::array<char, INET6_ADDRSTRLEN> text{};
  inet_ntop(AF_INET6, bytes.data(), text.data(), text.size());
  return std::string(text.data()) + "/64";
}

}  // namespace parhelion::station
