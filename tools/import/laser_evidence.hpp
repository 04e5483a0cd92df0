// What an importer saw of a laser, and the description that follows from it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "protocols/robot.hpp"
#include "protocols/scan.hpp"
#include "tools/import/import.hpp"

namespace parhelion::tools {

/// Gathered over the whole recording before the first event is written.
class LaserEvidence {
 public:
  std::optional<Transform<Base, Laser>> T_base_laser;  ///< where the source says it
  bool height_known = false;                           ///< whether its z is from the source
  float range_min = 0, range_max = 0;                  ///< m, as the source states them; 0: not stated
  std::optional<LaserDescription::StampBeam> stamp_beam;
  double beam_interval = 0, scan_period = 0;  ///< s, as the source states them; 0: not stated
  double noise_sigma = 0;                     ///< m, as the source states it
  std::string source;                         ///< text of the source for which there is no field

  void add(const Scan& scan);
  /// A beam that the source flags as having no reading, with the range that stands there.
  void add_flagged(float range) { ++flagged_[range]; }

  /// Its preset, where `options` name one or the beams are those of a known sensor, gives noise and timing;
  /// the source's own statements go first. What was assumed is added to `notes`.
  Result<LaserDescription> describe(const ImportOptions& options, std::vector<std::string>& notes) const;

 private:
  struct Shape {
    std::size_t beams;
    float angle_first, angle_step;
    auto operator<=>(const Shape&) const = default;
  };
  Shape most_common_shape() const;
  RangeConvention convention(std::vector<std::string>& notes) const;

  std::map<Shape, std::uint64_t> shapes_;
  std::map<float, std::uint64_t> flagged_;
  std::map<float, std::uint64_t>
      beyond_;  ///< unflagged ranges at or beyond what the source states as its maximum
  std::vector<std::int64_t> intervals_;
  std::optional<SensorTime> last_;
  float shortest_ = 0, longest_ = 0;  ///< m, of finite positive ranges below the stated maximum
  std::uint64_t zeros_ = 0, infinities_ = 0, nans_ = 0;
};

/// A description with what no recording says filled in, and said so in `notes`: a footprint around base and
/// laser.
RobotDescription describe_robot(const ImportOptions& options, std::optional<LaserDescription> laser,
                                std::vector<std::string>& notes);

/// Name of a robot from the options or the input's file name (letters, digits, '_' and '-').
std::string robot_name(const ImportOptions& options);

/// Preset whose field of view and resolution these beams have; empty: none.
std::string recognise_preset(std::size_t beams, double angle_step);

/// notes joined into one text.
std::string joined(const std::vector<std::string>& notes);

}  // namespace parhelion::tools
