#include "tools/model_summary.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace parhelion {
namespace {

using Json = nlohmann::ordered_json;

/// A tenth of a millimetre, or as fine an angle: no digits of floating point in a file that people read.
double tidy(double value) { return std::round(value * 1e4) / 1e4; }

/// The underside of the largest ceiling.
Json ceiling_of(const BuiltModel& built) {
  const ModelEntity* largest = nullptr;
  for (const ModelEntity& e : built.model.entities) {
    if (e.label != EntityLabel::ceiling || e.deleted) continue;
    if (largest == nullptr || e.size.x() * e.size.y() > largest->size.x() * largest->size.y()) largest = &e;
  }
  if (largest == nullptr) return nullptr;
  return tidy(largest->T_map_body.translation().z() - largest->size.z() / 2 - built.shift);
}

Json upright(const ModelEntity& e, const char* along, double shift) {
  const Eigen::Vector3d p = e.T_map_body.translation();
  Json json = {{"name", e.name}, {"centre", {tidy(p.x()), tidy(p.y()), tidy(p.z() - shift)}}};
  json[along] = tidy(e.size.x());
  json["height"] = tidy(e.size.z());
  json["yaw"] = tidy(e.T_map_body.yaw());
  json["confidence"] = tidy(e.confidence);
  return json;
}

Json rounded(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double value : values) list.push_back(tidy(value));
  return list;
}

}  // namespace

std::string model_summary(const BuiltModel& built, double seconds) {
  Json json;
  const auto floor = ground_floor(built.model);
  json["floor_m"] = floor ? Json(tidy(*floor - built.shift)) : Json(nullptr);
  json["ceiling_m"] = ceiling_of(built);
  json["walls"] = Json::array();
  json["doors"] = Json::array();
  for (const ModelEntity& e : built.model.entities) {
    if (e.deleted) continue;
    if (e.label == EntityLabel::wall) json["walls"].push_back(upright(e, "length", built.shift));
    if (e.label == EntityLabel::door) json["doors"].push_back(upright(e, "width", built.shift));
  }
  json["stairs"] = Json::array();
  for (const StairsFlight& flight : built.net.stairs) {
    json["stairs"].push_back({{"name", flight.name},
                              {"rises_m", rounded(flight.rises)},
                              {"treads_m", rounded(flight.treads)},
                              {"confidence", tidy(flight.confidence)}});
  }
  json["points"] = built.cloud.size();
  json["seconds"] = std::round(seconds * 1000) / 1000;
  return json.dump(2) + "\n";
}

}  // namespace parhelion
