#include "tools/map/model_summary.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace parhelion::tools {
namespace {

using Json = nlohmann::ordered_json;

/// Rounds to 1e-4 (0.1 mm), without floating-point noise in a file for people.
double tidy(double value) { return std::round(value * 1e4) / 1e4; }

Json tidy_or_null(const std::optional<double>& value) { return value ? Json(tidy(*value)) : Json(nullptr); }

Json level_of(const std::optional<semantic::LevelHeights>& level) {
  if (!level) return nullptr;
  return {{"p5", tidy(level->low)},
          {"median", tidy(level->median)},
          {"p95", tidy(level->high)},
          {"lean_rad", tidy(level->lean)}};
}

/// Spread of the heights, and the heights near the scanners.
Json heights_of(const semantic::SiteHeights& heights) {
  Json json = {{"floor_m", level_of(heights.floor)}, {"ceiling_m", level_of(heights.ceiling)}};
  json["scanners"] = Json::array();
  for (const semantic::ScannerHeights& scanner : heights.scanners) {
    json["scanners"].push_back({{"z_m", tidy(scanner.z)},
                                {"floor_m", tidy_or_null(scanner.floor)},
                                {"ceiling_m", tidy_or_null(scanner.ceiling)}});
  }
  return json;
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

Json quality_json(const semantic::ModelQuality& quality, double shift) {
  Json json = {{"line", semantic::quality_line(quality)},
               {"walls_m", tidy(quality.walls)},
               {"wall_support", tidy(quality.wall_support)},
               {"floor_cover", tidy(quality.floor_cover)},
               {"unknown_points", tidy(quality.unknown)}};
  json["doubtful"] = Json::array();
  for (const ModelDoubt& doubt : quality.doubts) {
    json["doubtful"].push_back(
        {{"entity", doubt.entity},
         {"place", {tidy(doubt.place.x()), tidy(doubt.place.y()), tidy(doubt.place.z() - shift)}},
         {"extent_m", tidy(doubt.extent)},
         {"reason", doubt.reason}});
  }
  return json;
}

Json object_json(const ModelObject& object, double shift) {
  const Eigen::Vector3d p = object.T_map_body.translation();
  Json json{{"name", object.name},
            {"kind", to_string(object.kind)},
            {"centre", {tidy(p.x()), tidy(p.y()), tidy(p.z() - shift)}},
            {"size", {tidy(object.size.x()), tidy(object.size.y()), tidy(object.size.z())}},
            {"yaw", tidy(object.T_map_body.yaw())},
            {"confidence", tidy(object.confidence)},
            {"movable", object.movable}};
  if (object.posture != Posture::unknown) json["posture"] = to_string(object.posture);
  return json;
}

}  // namespace

std::string model_summary(const semantic::BuiltModel& built, const semantic::ModelQuality& quality,
                          double seconds) {
  Json json;
  auto floor = semantic::ground_floor(built.model), ceiling = semantic::largest_ceiling(built.model);
  if (floor) *floor -= built.shift;
  if (ceiling) *ceiling -= built.shift;
  json["floor_m"] = tidy_or_null(floor);
  json["ceiling_m"] = tidy_or_null(ceiling);
  json["room_height_m"] = floor && ceiling ? Json(tidy(*ceiling - *floor)) : Json(nullptr);
  json["heights"] = heights_of(built.heights);
  json["walls"] = Json::array();
  json["doors"] = Json::array();
  for (const ModelEntity& e : built.model.entities) {
    if (e.deleted) continue;
    if (e.label == EntityLabel::wall) json["walls"].push_back(upright(e, "length", built.shift));
    if (e.label == EntityLabel::door) json["doors"].push_back(upright(e, "width", built.shift));
  }
  json["stairs"] = Json::array();
  for (const semantic::StairsFlight& flight : built.net.stairs) {
    json["stairs"].push_back({{"name", flight.name},
                              {"rises_m", rounded(flight.rises)},
                              {"treads_m", rounded(flight.treads)},
                              {"confidence", tidy(flight.confidence)}});
  }
  json["objects"] = Json::array();
  for (const ModelObject& object : built.objects) json["objects"].push_back(object_json(object, built.shift));
  json["quality"] = quality_json(quality, built.shift);
  json["notes"] = built.notes;
  json["points"] = built.cloud.size();
  json["points_left_out"] = std::count(built.left_out.begin(), built.left_out.end(), true);
  json["seconds"] = std::round(seconds * 1000) / 1000;
  return json.dump(2) + "\n";
}

}  // namespace parhelion::tools
