// Learns how a laser measures from its returns on flat surfaces, so that injected returns have the same
// noise.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "protocols/scan.hpp"
#include "protocols/status.hpp"

namespace parhelion::scan {

/// Neighbouring beams on one flat surface: a line fitted to them, and what is left. A laser that interlaces
/// passes sees the surface once a pass, and from a moving robot each time at another distance: that is
/// motion, which each beam that is cast at its own time has by itself, and no noise.
struct FlatWindow {
  static constexpr std::size_t kBeams = 17;
  std::size_t first = 0;                  ///< beam
  std::array<double, kBeams> range{};     ///< m, of the line along each beam, as its pass sees it
  std::array<double, kBeams> residual{};  ///< m, measured minus that
  double tan_incidence = 0;               ///< of its middle beam
  double sigma = 0;        ///< m, of the residuals, degrees of freedom of line and passes taken off
  double correlation = 0;  ///< of neighbouring residuals

  double middle_range() const { return range[kBeams / 2]; }
};

/// The line through kBeams returns from beam `first` on: least squares of errors along the beams, with a
/// distance of its own for each of the laser's passes. nullopt where one is no return, or where the beams
/// graze the line (more than 76 degrees from its normal).
std::optional<FlatWindow> fit_window(const Scan& scan, const LaserDescription& laser, std::size_t first);

/// What counts as flat: the largest residual (m) near each of RangeNoise's ranges, 5.5 times the sigma that
/// 15 % of the windows there are below: about four times the noise, whatever the laser, so that corners and
/// edges are left out.
class FlatnessGate {
 public:
  FlatnessGate(std::span<const Scan> scans, const LaserDescription& laser);
  bool passes(const FlatWindow& window) const;

 private:
  std::array<double, RangeNoise::kRanges> largest_{};
};

/// Windows of a scan that do not overlap and pass the gate.
std::vector<FlatWindow> flat_windows(const Scan& scan, const LaserDescription& laser,
                                     const FlatnessGate& gate);

struct LearnedLaser {
  double quantization = 0;  ///< m, 0: none found
  RangeNoise noise;
  double sigma = 0;  ///< m, median over all windows, quantisation taken off
  std::vector<float> intensity_codes, intensity_fractions;
  std::size_t windows = 0;
};

/// Error: fewer than 200 flat windows. Deterministic. Noise is matched by simulation (indirect inference,
/// Gourieroux, Monfort and Renault 1993): with what is learned, windows with the same lines have the same
/// sigma by range and incidence, spread of sigma, and correlation, quantisation included.
Result<LearnedLaser> learn_laser(std::span<const Scan> scans, const LaserDescription& laser);

/// The description with all of this.
LaserDescription with_learned(LaserDescription laser, const LearnedLaser& learned);

}  // namespace parhelion::scan
