#include "server/station/foxglove/scene_entity.hpp"

#include <cmath>

namespace parhelion::station::foxglove {

Colour seen(const Eigen::Vector3f& albedo) {
  const auto gamma = [](float linear) {
    return std::round(std::pow(static_cast<double>(linear), 1 / 2.2) * 1000) / 1000;
  };
  return {gamma(albedo.x()), gamma(albedo.y()), gamma(albedo.z()), 1};
}

void write_colour(const Colour& colour, JsonText& out) {
  out.open('{').key("r").number(colour[0]).key("g").number(colour[1]);
  out.key("b").number(colour[2]).key("a").number(colour[3]).close('}');
}

void add_triangles(const Eigen::Isometry3d& T_frame_mesh, const std::vector<Eigen::Vector3f>& vertices,
                   const std::vector<std::array<std::uint32_t, 3>>& triangles, const Colour& colour,
                   JsonText& list) {
  list.open('{').key("pose").pose(T_frame_mesh).key("points").open('[');
  for (const Eigen::Vector3f& p : vertices)
    list.open('{').key("x").number(p.x()).key("y").number(p.y()).key("z").number(p.z()).close('}');
  list.close(']').key("color");
  write_colour(colour, list);
  list.key("colors").open('[').close(']').key("indices").open('[');
  for (const auto& triangle : triangles)
    for (const std::uint32_t corner : triangle) list.integer(corner);
  list.close(']').close('}');
}

void write_entity(std::int64_t stamp, std::string_view frame, std::string_view id,
                  std::initializer_list<std::pair<const char*, std::string_view>> notes, Primitives& what,
                  JsonText& out) {
  out.open('{').key("timestamp").time(stamp).key("frame_id").string(frame).key("id").string(id);
  out.key("lifetime").time(0).key("frame_locked").boolean(frame != "map").key("metadata").open('[');
  for (const auto& [key, value] : notes)
    out.open('{').key("key").unescaped(key).key("value").string(value).close('}');
  out.close(']');
  const std::pair<const char*, JsonText*> lists[] = {
      {"cubes", &what.cubes}, {"spheres", &what.spheres},     {"cylinders", &what.cylinders},
      {"texts", &what.texts}, {"triangles", &what.triangles}, {"arrows", &what.arrows},
      {"lines", &what.lines}};
  for (const auto& [name, list] : lists) out.key(name).raw(list->close(']').text());
  out.key("models").open('[').close(']');
  out.close('}');
}

}  // namespace parhelion::station::foxglove
