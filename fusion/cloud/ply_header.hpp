// The header of a PLY file (Turk 1994).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fusion/cloud/cloud_builder.hpp"

namespace parhelion::cloud {

struct PlyProperty {
  Column column = Column::ignored;
  Scalar type = Scalar::f32;
  std::optional<Scalar> count;  ///< type of the number of elements in a list
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  bool has_lists() const;
  /// Minimum bytes of one record; a list contributes only its count.
  std::uint64_t min_bytes() const;
};

struct PlyHeader {
  enum class Encoding : std::uint8_t { ascii, little_endian, big_endian };
  Encoding encoding = Encoding::ascii;
  std::vector<PlyElement> elements;         ///< up to and including the vertices; later elements are ignored
  std::vector<Eigen::Vector3d> viewpoints;  ///< in the file's unit and axes
  std::size_t body = 0;                     ///< offset of the first byte after the header
  std::uint64_t lines = 0;
};

Result<PlyHeader> parse_ply_header(std::string_view bytes, const std::string& name);

}  // namespace parhelion::cloud
