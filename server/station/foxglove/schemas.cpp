#include "server/station/foxglove/schemas.hpp"

#include <initializer_list>
#include <map>
#include <utility>

namespace parhelion::station::foxglove {
namespace {

using Member = std::pair<const char*, std::string>;

const std::string number = R"({"type":"number"})", text = R"({"type":"string"})",
                  boolean = R"({"type":"boolean"})", count = R"({"type":"integer","minimum":0})",
                  bytes = R"({"type":"string","contentEncoding":"base64"})";

std::string object_of(const std::string& title, std::initializer_list<Member> members) {
  std::string properties, required;
  for (const auto& [name, schema] : members) {
    const std::string quoted = std::string("\"") + name + "\"";
    properties += (properties.empty() ? "" : ",") + quoted + ":" + schema;
    required += (required.empty() ? "" : ",") + quoted;
  }
  return "{\"title\":\"" + title + "\",\"type\":\"object\",\"properties\":{" + properties +
         "},\"required\":[" + required + "]}";
}

std::string list_of(const std::string& items) { return R"({"type":"array","items":)" + items + "}"; }

const std::string nanoseconds_of_second = R"({"type":"integer","minimum":0,"maximum":999999999})";
const std::string stamp = object_of("time", {{"sec", count}, {"nsec", nanoseconds_of_second}});
const std::string duration =
    object_of("duration", {{"sec", R"({"type":"integer"})"}, {"nsec", nanoseconds_of_second}});
const std::string vector3 = object_of("foxglove.Vector3", {{"x", number}, {"y", number}, {"z", number}});
const std::string point3 = object_of("foxglove.Point3", {{"x", number}, {"y", number}, {"z", number}});
const std::string quaternion =
    object_of("foxglove.Quaternion", {{"x", number}, {"y", number}, {"z", number}, {"w", number}});
const std::string pose = object_of("foxglove.Pose", {{"position", vector3}, {"orientation", quaternion}});
const std::string colour =
    object_of("foxglove.Color", {{"r", number}, {"g", number}, {"b", number}, {"a", number}});

std::string scene_entity() {
  const std::string pair = object_of("foxglove.KeyValuePair", {{"key", text}, {"value", text}});
  const std::string arrow = object_of("foxglove.ArrowPrimitive", {{"pose", pose},
                                                                  {"shaft_length", number},
                                                                  {"shaft_diameter", number},
                                                                  {"head_length", number},
                                                                  {"head_diameter", number},
                                                                  {"color", colour}});
  const std::string cube =
      object_of("foxglove.CubePrimitive", {{"pose", pose}, {"size", vector3}, {"color", colour}});
  const std::string sphere =
      object_of("foxglove.SpherePrimitive", {{"pose", pose}, {"size", vector3}, {"color", colour}});
  const std::string cylinder = object_of("foxglove.CylinderPrimitive", {{"pose", pose},
                                                                        {"size", vector3},
                                                                        {"bottom_scale", number},
                                                                        {"top_scale", number},
                                                                        {"color", colour}});
  const std::string line = object_of("foxglove.LinePrimitive", {{"type", count},
                                                                {"pose", pose},
                                                                {"thickness", number},
                                                                {"scale_invariant", boolean},
                                                                {"points", list_of(point3)},
                                                                {"color", colour},
                                                                {"colors", list_of(colour)},
                                                                {"indices", list_of(count)}});
  const std::string triangles = object_of("foxglove.TriangleListPrimitive", {{"pose", pose},
                                                                             {"points", list_of(point3)},
                                                                             {"color", colour},
                                                                             {"colors", list_of(colour)},
                                                                             {"indices", list_of(count)}});
  const std::string words = object_of("foxglove.TextPrimitive", {{"pose", pose},
                                                                 {"billboard", boolean},
                                                                 {"font_size", number},
                                                                 {"scale_invariant", boolean},
                                                                 {"color", colour},
                                                                 {"text", text}});
  const std::string model = object_of("foxglove.ModelPrimitive", {{"pose", pose},
                                                                  {"scale", vector3},
                                                                  {"color", colour},
                                                                  {"override_color", boolean},
                                                                  {"url", text},
                                                                  {"media_type", text},
                                                                  {"data", bytes}});
  return object_of("foxglove.SceneEntity", {{"timestamp", stamp},
                                            {"frame_id", text},
                                            {"id", text},
                                            {"lifetime", duration},
                                            {"frame_locked", boolean},
                                            {"metadata", list_of(pair)},
                                            {"arrows", list_of(arrow)},
                                            {"cubes", list_of(cube)},
                                            {"spheres", list_of(sphere)},
                                            {"cylinders", list_of(cylinder)},
                                            {"lines", list_of(line)},
                                            {"triangles", list_of(triangles)},
                                            {"texts", list_of(words)},
                                            {"models", list_of(model)}});
}

std::map<std::string, std::string, std::less<>> all() {
  const Member timestamp{"timestamp", stamp}, frame{"frame_id", text};
  const std::string transform = object_of("foxglove.FrameTransform", {timestamp,
                                                                      {"parent_frame_id", text},
                                                                      {"child_frame_id", text},
                                                                      {"translation", vector3},
                                                                      {"rotation", quaternion}});
  const std::string deletion =
      object_of("foxglove.SceneEntityDeletion", {timestamp, {"type", count}, {"id", text}});
  const auto matrix = [](const char* size) {
    return std::string(R"({"type":"array","items":{"type":"number"},"minItems":)") + size +
           ",\"maxItems\":" + size + "}";
  };
  std::map<std::string, std::string, std::less<>> schemas;
  const auto add = [&](const char* name, std::initializer_list<Member> members) {
    schemas[name] = object_of(name, members);
  };
  add("foxglove.LaserScan", {timestamp,
                             frame,
                             {"pose", pose},
                             {"start_angle", number},
                             {"end_angle", number},
                             {"ranges", list_of(number)},
                             {"intensities", list_of(number)}});
  add("foxglove.PoseInFrame", {timestamp, frame, {"pose", pose}});
  add("foxglove.FrameTransforms", {{"transforms", list_of(transform)}});
  add("foxglove.CompressedImage", {timestamp, frame, {"data", bytes}, {"format", text}});
  add("foxglove.RawImage", {timestamp,
                            frame,
                            {"width", count},
                            {"height", count},
                            {"encoding", text},
                            {"step", count},
                            {"data", bytes}});
  add("foxglove.CameraCalibration", {timestamp,
                                     frame,
                                     {"width", count},
                                     {"height", count},
                                     {"distortion_model", text},
                                     {"D", list_of(number)},
                                     {"K", matrix("9")},
                                     {"R", matrix("9")},
                                     {"P", matrix("12")}});
  add("foxglove.SceneUpdate", {{"deletions", list_of(deletion)}, {"entities", list_of(scene_entity())}});
  add("foxglove.Log",
      {timestamp, {"level", count}, {"message", text}, {"name", text}, {"file", text}, {"line", count}});
  add("parhelion.Twist", {timestamp, {"vx", number}, {"vy", number}, {"wz", number}});
  add("parhelion.Injection", {timestamp,
                              {"live", boolean},
                              {"reason", text},
                              {"predicted_error", number},
                              {"replaced_beams", count}});
  add("parhelion.Score", {timestamp, {"score", number}});
  // Lists, since Foxglove does not support schemas of objects with arbitrary member names.
  const std::string value = object_of("parhelion.Value", {{"name", text}, {"value", number}});
  const std::string note = object_of("parhelion.Note", {{"name", text}, {"text", text}});
  add("parhelion.Status", {timestamp, {"values", list_of(value)}, {"notes", list_of(note)}});
  return schemas;
}

}  // namespace

std::string schema_text(std::string_view name) {
  static const auto schemas = all();
  const auto found = schemas.find(name);
  return found == schemas.end() ? std::string() : found->second;
}

}  // namespace parhelion::station::foxglove
