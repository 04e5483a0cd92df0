// Collects the observations of a laser and derives its description from them.
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

/// Collected over the whole recording before the first event is written.
class LaserEvidence {
 public:
  std::optional<Transform<Base, Laser>> T_base_laser;  ///< if the source contains it
  bool height_known = false;                           ///< its z is from the source
  float range_min = 0, range_max = 0;                  ///< m, from the source; 0: not stated
  std::optional<LaserDescription::StampBeam> stamp_beam;
  double beam_interval = 0, scan_period = 0;  ///< s, from the source; 0: not stated
  double noise_sigma = 0;                     ///< m, from the source
  std::string source;                         ///< further text of the source

  void add(const Scan& scan);
  /// A beam flagged by the source as invalid, with its range value.
  void add_flagged(float range) { ++flagged_[range]; }

  /// Noise and timing come from a preset, if `options` name one or the beams match a known sensor; values of
  /// the source have priority. Assumptions are added to `notes`.
  Result<LaserDescription> describe(const ImportOptions& options, std::vector<std::string>& notes) const;

 private:
  struct Shape {
    std::size_t beams;
    float angle_min, angle_increment;
    auto operator<=>(const Shape&) const = default;
  };
  Shape most_common_shape() const;
  RangeConvention convention(std::vector<std::string>& notes) const;

  std::map<Shape, std::uint64_t> shapes_;
  std::map<float, std::uint64_t> flagged_;
  std::map<float, std::uint64_t> beyond_;  ///< unflagged ranges at or beyond the maximum stated by the source
  std::vector<std::int64_t> intervals_;
  std::optional<SensorTime> last_;
  float shortest_ = 0, longest_ = 0;  ///< m, of finite positive ranges below the stated maximum
  std::uint64_t zeros_ = 0, infinities_ = 0, nans_ = 0;
};

/// A description with assumed values for what recordings do not contain (a footprint around base and laser),
/// reported in `notes`.
RobotDescription describe_robot(const ImportOptions& options, std::optional<LaserDescription> laser,
                                std::vector<std::string>& notes);

/// Robot name from the options or the input's file name (letters, digits, '_' and '-').
std::string robot_name(const ImportOptions& options);

/// Preset with the field of view and resolution of these beams; empty: none.
std::string recognise_preset(std::size_t beams, double angle_increment);

/// The notes joined into one text.
std::string joined(const std::vector<std::string>& notes);

}  // namespace parhelion::tools
