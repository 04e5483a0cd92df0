// A planar laser scan as received from the sensor, and the interpretation of its values.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/time.hpp"

namespace parhelion {

/// One scan; beam i points at angle(i) in the laser's xy-plane.
struct Scan {
  SensorTime stamp;                ///< instant of the beam that LaserDescription::stamp_beam names
  std::vector<float> ranges;       ///< metres, sentinels as received from the sensor (never rewritten)
  std::vector<float> intensities;  ///< empty, or one per beam; sensor's own unit
  float angle_min = 0;             ///< rad, of beam 0
  /// rad, negative where the sensor sweeps clockwise; the mean where the beams have angles of their own.
  float angle_increment = 0;
  std::vector<float> angles;  ///< rad: empty, or one per beam where they are not evenly spaced (lidar_t)
  std::vector<std::int64_t> times;  ///< us since the epoch as received: empty, or one per beam (lidar_t)

  double angle(std::size_t i) const {
    return angles.empty() ? double{angle_min} + static_cast<double>(i) * double{angle_increment}
                          : double{angles[i]};
  }
  /// Whether `times` tells the beams apart: a sensor that does not measure them writes one instant into all.
  bool is_timed() const { return !times.empty() && times.front() != times.back(); }
  /// The beam nearest to a direction (rad); nullopt: none within a step of it, or no beam.
  std::optional<std::size_t> beam_at(double angle) const;
};

/// For readers that know evenly spaced beams alone, angle_increment apart: for each of them the beam of
/// `scan` that is nearest to its direction; nullopt: none is within a step. Beams that are evenly spaced:
/// themselves.
std::vector<std::optional<std::size_t>> nearest_beams(const Scan& scan);
/// The scan with these beams; NaN where there is none.
Scan evenly_spaced(const Scan& scan);

/// Meaning of one range on the wire, in REP-117's terms.
enum class BeamKind : std::uint8_t { hit, no_return /* +inf */, too_close /* -inf */, invalid /* NaN */ };

/// How a sensor encodes values that are not ranges.
struct RangeConvention {
  enum class Sentinel : std::uint8_t { value, infinity, nan };
  float range_min = 0;  ///< m; a finite range below it is too close
  float range_max = 0;  ///< m; a finite range at or above it is no return
  Sentinel no_return = Sentinel::infinity;
  float no_return_value =
      0;  ///< m, where no_return is Sentinel::value (81.83 for an LMS-200 in CARMEN logs, 0 for others)
  Sentinel too_close = Sentinel::value;
  float too_close_value = 0;  ///< m, where too_close is Sentinel::value

  BeamKind classify(float range) const;
  float no_return_sentinel() const;
  float too_close_sentinel() const;
};

/// Noise of a laser as learned from its returns on walls (`parhelion calibrate`).
struct RangeNoise {
  static constexpr std::size_t kRanges = 6;
  /// m, 1 sigma before quantization, at ranges of 1, 2, 4, 8, 16 and 32 m; all 0: noise_sigma at any range.
  std::array<double, kRanges> sigma{};
  double incidence = 0;    ///< m, 1 sigma in addition per unit of the tangent of the angle of incidence
  double spread = 0;       ///< 1 sigma of the logarithm of sigma from one patch of a surface to the next
  double correlation = 0;  ///< of neighbouring beams
  double dropout = 0;      ///< fraction of beams on a surface without a return

  bool learned() const { return sigma != std::array<double, kRanges>{}; }
};

/// A planar laser on a robot.
struct LaserDescription {
  enum class StampBeam : std::uint8_t { first, middle, last };

  std::string preset;  ///< name of its preset, or empty
  Transform<Base, Laser> T_base_laser;
  RangeConvention convention;
  StampBeam stamp_beam = StampBeam::first;
  /// In the order of measurement beam i belongs to pass i % passes, as beam i / passes of it: an LMS-200 at
  /// 0.5 degrees makes two interlaced passes.
  int passes = 1;
  double pass_period = 0;  ///< s between the starts of two passes
  /// s between two beams of one pass; negative where the last beam of a message is measured first, as by a
  /// driver that sorts the beams of a laser that turns clockwise
  double beam_interval = 0;
  double scan_period = 0;  ///< s between two scans, 0 where unknown
  double noise_sigma = 0;  ///< m, 1 sigma, of a range
  RangeNoise range_noise;
  double quantization = 0;     ///< m, step of a range on the wire, 0: none
  double intensity_scale = 1;  ///< the sensor's intensity for a reflectivity of 1; that of 0 is 0
  /// Intensities that the sensor writes for surfaces, and the fraction of each; empty: by reflectivity.
  std::vector<float> intensity_codes, intensity_fractions;
  bool intensities = false;  ///< simulated scans carry intensities, like this sensor's
  /// For simulated lasers: number of beams.
  int beams = 0;
  double angle_min = 0;        ///< rad
  double angle_increment = 0;  ///< rad
  /// Text of an imported source that has no field here ("source" topic, CameraInfo and so on).
  std::string source;

  /// Instant of beam i of n, relative to the scan's stamp.
  Duration beam_time(std::size_t i, std::size_t n) const;
  /// The same by the scan's own times where it has them.
  Duration beam_time(std::size_t i, const Scan& scan) const;
};

}  // namespace parhelion
