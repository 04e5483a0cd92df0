// The tracker on a synthetic crowd.
#pragma once

#include "fusion/people/people_tracker.hpp"
#include "tests/fusion/people/evaluation.hpp"
#include "tests/fusion/people/synthetic_crowd.hpp"

namespace parhelion::test {

/// Persons count from this number of beams in a scan and up to this range.
inline constexpr int kVisibleBeams = 4;
inline constexpr double kVisibleRange = 8;

inline people::LaserSweep sweep_of(const Crowd& crowd, const CrowdScan& scan) {
  return {0,           scan.scan,  crowd.laser, scan.estimated, crowd.beam_time, scan.building,
          crowd.sigma, scan.stamp, {}};
}

inline PeopleScore score(const CrowdOptions& crowd_options, const people::PeopleOptions& options = {}) {
  const Crowd crowd = make_crowd(crowd_options);
  people::PeopleTracker tracker(options);
  PeopleScore result;
  for (const CrowdScan& scan : crowd.scans) {
    const auto movers = tracker.update(sweep_of(crowd, scan));
    std::vector<KnownPerson> known;
    for (const TruePerson& person : scan.people) {
      const bool near = (person.position - scan.T_map_laser.position()).norm() < kVisibleRange;
      known.push_back({person.id, person.position, near && person.beams >= kVisibleBeams});
    }
    result.add(movers, known, true, crowd.laser.scan_period);
  }
  result.finish();
  return result;
}

}  // namespace parhelion::test
