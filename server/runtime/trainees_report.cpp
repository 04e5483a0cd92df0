#include "server/runtime/trainees_report.hpp"

#include <nlohmann/json.hpp>

namespace parhelion::runtime {

std::string to_trainees_json(const Report& report) {
  using Json = nlohmann::ordered_json;
  const Json all = Json::parse(to_json(report));
  Json json;
  for (const char* key : {"complete", "scans", "frames", "latency_us", "seconds", "grade"})
    if (all.contains(key)) json[key] = all[key];
  for (const char* list : {"tasks", "deductions"}) {
    if (!json.contains("grade") || !json["grade"].contains(list)) continue;
    for (Json& each : json["grade"][list]) each.erase("cause");
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace parhelion::runtime
