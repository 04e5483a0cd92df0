// 3D scans from files: PLY, PCD, XYZ and 3DTK's .3d, each in its own unit and axes, into one form: metres,
// REP-103 axes, finite points.
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
  ply,    ///< ASCII, binary little and big endian
  pcd,    ///< PCL's: ASCII, binary, binary_compressed
  xyz,    ///< text: x y z [red green blue | nx ny nz], or x y z intensity [red green blue]
  uos_3d  ///< 3DTK: one line of heading, then x y z [more]; the pose in a file .pose beside it
};

enum class LengthUnit : std::uint8_t { metre, centimetre, millimetre };

/// Axes of a file, and how they go to x forward, y left, z up.
enum class FileAxes : std::uint8_t {
  x_forward_z_up,        ///< REP-103: as they are
  x_right_y_up,          ///< right-handed, z backward (OpenGL): (-z, -x, y)
  x_right_y_down,        ///< right-handed, z forward (optical): (z, -x, -y)
  x_right_y_up_mirrored  ///< left-handed, z forward (3DTK): (z, -x, y)
};

struct ReadOptions {
  std::optional<LengthUnit> unit;  ///< default: centimetre for .3d, else metre
  std::optional<FileAxes> axes;    ///< default: x_right_y_up_mirrored for .3d, else x_forward_z_up
  std::uint64_t memory = 0;        ///< bytes that reading may take; 0: what the machine has available
  std::uint64_t work_per_point =
      0;  ///< bytes that the caller will need beside: refused before anything is read
};

struct ScanFile {
  std::string name;                                ///< as given, for messages
  PointCloud<Scanner> cloud;                       ///< in the file's order; duplicates kept
  std::optional<Transform<Cloud, Scanner>> guess;  ///< from the .pose of a .3d
  std::uint64_t not_finite = 0;                    ///< points left out for NaN or infinity
  std::vector<std::string> notes;  ///< what a person should know: a suspected unit, labels left out
};

/// Reads one file; its format is told by its first bytes, else by its extension (.ply .pcd .3d .xyz .txt
/// .asc .pts .csv). A PCD's VIEWPOINT becomes `viewpoints[0]`; the default one (identity) says nothing and is
/// not taken. The file must not be cut by another program meanwhile.
/// Errors say file and line or byte offset, what was expected: a header that lies (counts beyond what the
/// file holds, or sizes that contradict each other), a cut file, words that are no numbers, no x y z, no
/// finite point, more points than `memory` holds.
Result<ScanFile> read_scan(const std::filesystem::path& path, const ReadOptions& options = {});

/// The same from memory, without the .pose. `name` is for messages.
Result<ScanFile> parse_scan(std::string_view bytes, const std::string& name, ScanFormat format,
                            const ReadOptions& options = {});

/// A 3DTK .pose: "x y z" and "rx ry rz" in degrees, R = Rx Ry Rz in the file's axes. Same defaults as a .3d.
Result<Transform<Cloud, Scanner>> parse_uos_pose(std::string_view bytes, const std::string& name,
                                                 const ReadOptions& options = {});

}  // namespace parhelion::cloud
