// Reads 3D scans from PLY, PCD, LAS, XYZ, OctoMap's .bt and 3DTK's .3d files, each with its own unit and
// axes, and converts them to metres, REP-103 axes and finite points.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "protocols/frames.hpp"
#include "protocols/status.hpp"

namespace parhelion::cloud {

enum class ScanFormat : std::uint8_t {
  ply,     ///< ASCII, binary little and big endian
  pcd,     ///< PCL's: ASCII, binary, binary_compressed
  xyz,     ///< text: x y z [red green blue | nx ny nz], or x y z intensity [red green blue]
  las,     ///< 1.0 to 1.4, point formats 0 to 10, not compressed
  octree,  ///< OctoMap's binary tree: the centres of its occupied cubes
  uos_3d   ///< 3DTK: one header line, then x y z [more]; the pose in a .pose file beside it
};

enum class LengthUnit : std::uint8_t { metre, centimetre, millimetre, foot, inch };

/// Axes of a file, and their conversion to x forward, y left, z up.
enum class FileAxes : std::uint8_t {
  x_forward_z_up,        ///< REP-103: unchanged
  x_right_y_up,          ///< right-handed, z backward (OpenGL): (-z, -x, y)
  x_right_y_down,        ///< right-handed, z forward (optical): (z, -x, -y)
  x_right_y_up_mirrored  ///< left-handed, z forward (3DTK): (z, -x, y)
};

struct ReadOptions {
  std::optional<LengthUnit> unit;    ///< default: centimetre for .3d, else metre
  std::optional<FileAxes> axes;      ///< default: x_right_y_up_mirrored for .3d, else x_forward_z_up
  std::uint64_t memory = 0;          ///< bytes that reading may take; 0: what the machine has available
  std::uint64_t work_per_point = 0;  ///< bytes that the caller needs in addition; checked before reading
};

struct ScanFile {
  std::string name;                                ///< as given, for messages
  PointCloud<Scanner> cloud;                       ///< in the file's order; duplicates kept
  std::optional<Transform<Cloud, Scanner>> guess;  ///< from the .pose of a .3d
  std::optional<double> spacing;                   ///< m, of the cubes of an octree
  std::uint64_t not_finite = 0;                    ///< points left out for NaN or infinity
  std::uint64_t no_return = 0;     ///< points left out, all at the origin: what returned nothing
  std::vector<std::string> notes;  ///< notes for the user: a suspected unit, dropped labels
};

/// Reads one file; its format is detected from its first bytes, else from its extension (.ply .pcd .las .bt
/// .3d .xyz .txt .asc .pts .csv). A PCD's VIEWPOINT becomes `viewpoints[0]`; the default one (identity)
/// carries no information and is ignored. The file must not be truncated by another program meanwhile. Errors
/// name file, line or byte offset, and what was expected: an inconsistent header (counts beyond the file's
/// size, contradicting sizes), a truncated file, words that are not numbers, no x y z, no finite point, more
/// points than `memory` holds.
Result<ScanFile> read_scan(const std::filesystem::path& path, const ReadOptions& options = {});

/// The same from memory, without the .pose. `name` is used in messages.
Result<ScanFile> parse_scan(std::string_view bytes, const std::string& name, ScanFormat format,
                            const ReadOptions& options = {});

/// A 3DTK .pose: "x y z" and "rx ry rz" in degrees, R = Rx Ry Rz in the file's axes. Same defaults as a .3d.
Result<Transform<Cloud, Scanner>> parse_uos_pose(std::string_view bytes, const std::string& name,
                                                 const ReadOptions& options = {});

}  // namespace parhelion::cloud
