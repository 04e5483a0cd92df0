#include "server/station/http/login_guard.hpp"

#include <algorithm>

namespace parhelion::station {
namespace {

constexpr Duration kForgotten = seconds(3600.0);
constexpr std::size_t kMaxRecords = 1024;

}  // namespace

Duration LoginGuard::admit(const std::string& network, const std::string& name, WallTime now) {
  const Duration left = std::max(wait(names_, name, now), wait(networks_, network, now));
  if (left.ns > 0) return left;
  count(names_, name, kNameRule, now);
  count(networks_, network, kNetworkRule, now);
  return {};
}

void LoginGuard::succeeded(const std::string& network, const std::string& name) {
  names_.erase(name);
  // A success with one's own account gives no new attempts at others'.
  const auto record = networks_.find(network);
  if (record == networks_.end()) return;
  if (record->second.failed > 0) record->second.failed -= 1;
  record->second.until = record->second.last;
}

Duration LoginGuard::wait(const Records& records, const std::string& key, WallTime now) {
  const auto record = records.find(key);
  return record == records.end() ? Duration{} : std::max(Duration{}, record->second.until - now);
}

void LoginGuard::count(Records& records, const std::string& key, const Rule& rule, WallTime now) {
  if (records.size() >= kMaxRecords && !records.contains(key)) {
    std::erase_if(records, [now](const auto& entry) { return now - entry.second.last > kForgotten; });
    if (records.size() >= kMaxRecords) {
      records.erase(std::min_element(records.begin(), records.end(), [](const auto& a, const auto& b) {
        return a.second.until < b.second.until;
      }));
    }
  }
  Record& record = records[key];
  if (now - record.last > kForgotten) record.failed = 0;
  record.failed += 1;
  record.last = record.until = now;
  if (record.failed < rule.free) return;
  const unsigned doublings = std::min(record.failed - rule.free, 20U);
  record.until = now + std::min(rule.longest, seconds(static_cast<double>(1U << doublings)));
}

}  // namespace parhelion::station
