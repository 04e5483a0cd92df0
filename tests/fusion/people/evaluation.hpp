// How well people were tracked, against known places.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "fusion/people/mover.hpp"

namespace parhelion::test {

struct KnownPerson {
  int id = 0;
  Eigen::Vector2d position;
  bool counted = true;  ///< false: need not be found, but whoever finds it is right
};

/// Counts over scans; see add().
class PeopleScore {
 public:
  static constexpr double kGone = 2;      // s out of sight: whoever returns may have a new identity
  static constexpr double kRadius = 0.5;  // m: a person reported this near to a known one is that one

  /// A scan: `movers` reported by the tracker, of which persons seen within half a second count; `people` who
  /// are there. `complete`: nobody else is there. `dt`: s since the scan before.
  void add(std::span<const people::Mover> movers, std::span<const KnownPerson> people, bool complete,
           double dt);
  /// A scan without labels: nothing counts.
  void skip(double dt);
  PeopleScore& operator+=(const PeopleScore& other);

  double recall() const { return ratio(found, wanted); }
  double precision() const { return ratio(right, reported); }
  double switches_a_minute() const { return minutes > 0 ? switches / minutes : 0; }
  double switches_a_person_minute() const { return person_minutes > 0 ? switches / person_minutes : 0; }
  double rms_error() const;                ///< m
  double error_quantile(double q) const;   ///< m
  double first_detection(double q) const;  ///< s of being visible, quantile over the persons

  int wanted = 0, found = 0, reported = 0, right = 0, switches = 0;
  double minutes = 0, person_minutes = 0;
  std::vector<double> errors;  ///< m
  std::vector<double> first;   ///< s until each person was found; those never found: their visible time

  /// Ends a recording: persons never found are counted in `first`.
  void finish();

 private:
  struct Known {
    double visible = 0;  // s
    bool found = false;
    std::uint32_t track = 0;
    double unseen = 0;  // s
  };
  static double ratio(int a, int b) { return b > 0 ? static_cast<double>(a) / b : 1; }
  void match(const KnownPerson& person, const people::Mover* best, double dt);

  std::map<int, Known> known_;
};

}  // namespace parhelion::test
