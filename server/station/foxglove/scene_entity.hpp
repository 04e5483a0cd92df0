// Entities of foxglove.SceneUpdate and what they are made of. Private to this module.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <initializer_list>
#include <string_view>
#include <utility>
#include <vector>

#include "server/station/foxglove/json_text.hpp"

namespace parhelion::station::foxglove {

using Colour = std::array<double, 4>;  // red, green, blue, alpha; sRGB

/// The fields of a scene entity after its header, by kind.
struct Primitives {
  JsonText cubes, spheres, cylinders, texts, triangles, arrows, lines;
  Primitives() {
    for (JsonText* list : {&cubes, &spheres, &cylinders, &texts, &triangles, &arrows, &lines})
      list->open('[');
  }
};

/// Of a linear colour.
Colour seen(const Eigen::Vector3f& albedo);
void write_colour(const Colour& colour, JsonText& out);

/// `T_frame_mesh`: of the vertices, in the entity's frame.
void add_triangles(const Eigen::Isometry3d& T_frame_mesh, const std::vector<Eigen::Vector3f>& vertices,
                   const std::vector<std::array<std::uint32_t, 3>>& triangles, const Colour& colour,
                   JsonText& list);

/// An entity of the frame moves with it if that is not the map. Closes the lists of `what`.
void write_entity(std::int64_t stamp, std::string_view frame, std::string_view id,
                  std::initializer_list<std::pair<const char*, std::string_view>> notes, Primitives& what,
                  JsonText& out);

}  // namespace parhelion::station::foxglove
