// What the last seconds' scans of one laser say of a place: seen free, or occupied all along. The evidence
// that something is there that was not there before, without a map.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "fusion/people/laser_sweep.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::people {

/// Counts of past scans.
struct PlaceEvidence {
  Duration occupied_for;  ///< how long no scan saw it free, up to the newest that can have
  int free = 0;           ///< saw through the place
  int occupied = 0;       ///< had a return there
  int old_occupied = 0;   ///< of these, older ones (SeenFreeOptions::old)

  /// Fraction of free ones; 0 without any evidence.
  double free_fraction() const {
    const int known = free + occupied;
    return known > 0 ? static_cast<double>(free) / known : 0;
  }
};

struct SeenFreeOptions {
  Duration min_age = milliseconds(400);        ///< a slower walker has not left its place yet
  Duration recent_period = milliseconds(200);  ///< between recent scans that are kept
  std::size_t recent = 6;
  Duration old_period = milliseconds(1500);  ///< between older ones
  std::size_t old = 6;
  double behind = 0.2;   ///< m that a beam must reach beyond a place that it saw free
  double depth = 0.12;   ///< m of a return before or behind a place that is occupied
  double margin = 0.04;  ///< m beside a place: everything there has to be free
};

/// Memory is reused from scan to scan.
class SeenFree {
 public:
  explicit SeenFree(const SeenFreeOptions& options = {}) : options_(options) {}

  /// `radius`: m, of the place; `sigma`: m, of the poses.
  PlaceEvidence at(const Eigen::Vector2d& place, double radius, double sigma, SimulationTime now) const;
  void add(const LaserSweep& sweep);

 private:
  struct PastScan {
    bool valid = false;
    SimulationTime stamp;
    Pose2 T_laser_map;
    double cos_yaw = 1, sin_yaw = 0;  ///< of that pose: sine and cosine take as long as the rest of a look
    double angle_min = 0, angle_increment = 0;
    std::vector<float> free_to;  ///< m per beam: seen free up to here; negative: unknown
  };
  void store(const LaserSweep& sweep, PastScan& slot) const;
  enum class Look : std::uint8_t { unknown, free, occupied };
  Look look(const PastScan& past, const Eigen::Vector2d& place, double radius, double sigma) const;
  static void count(Look what, bool old, Duration age, PlaceEvidence& evidence, Duration& newest_free);

  SeenFreeOptions options_;
  std::vector<PastScan> recent_, old_;  // rings
  std::size_t next_recent_ = 0, next_old_ = 0;
};

}  // namespace parhelion::people
