// How well a model describes a site that is known.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "fusion/semantic/build_model.hpp"
#include "tests/mean_sites/mean_scan.hpp"

namespace parhelion::test {

/// Sums over sites; lengths in m.
struct MeanScore {
  int sites = 0, refused = 0;
  double drawn = 0, drawn_right = 0;  ///< walls in plan, within 10 cm of a true one
  double seen = 0, seen_found = 0;    ///< faces of true walls with points, within 10 cm of a drawn one
  double crossing = 0;                ///< walls drawn where nothing stands
  int false_doors = 0, false_pillars = 0, false_flights = 0;
  int doors = 0, doors_found = 0;
  int steps = 0, steps_found = 0, false_steps = 0;
  double rise_error = 0;  ///< of flights found, largest of the sites: |median of rises - truth|
  int ramps = 0, ramps_found = 0, false_ramps = 0;  ///< of ramps with enough points in the scan
  double slope_error = 0, edge_error = 0;  ///< of ramps found: rad and m, sums of |found - true|, the latter
                                           ///< of length and width
  int kerbs = 0, kerbs_found = 0, false_kerbs = 0;  ///< of kerbs with 2 m measured on both sides
  double kerb_error = 0;  ///< m, of kerbs found: sum of the distances from their edge to the true one
  double raised = 0, called_floor = 0;  ///< points of things over the floor; of these labelled floor
  double points = 0, unknown = 0;
  int objects = 0, objects_found = 0, objects_right = 0, false_objects = 0;
  std::map<std::pair<std::string, std::string>, int>
      kinds;                          ///< of objects found: true kind or "no object", ours
  std::map<std::string, int> amid;    ///< of false objects: what most of their points lie on
  double seconds = 0, processor = 0;  ///< s, of the model alone: wall, and of all threads

  double precision() const { return drawn > 0 ? drawn_right / drawn : 1; }
  double recall() const { return seen > 0 ? seen_found / seen : 1; }
  double f1() const {
    const double sum = precision() + recall();
    return sum > 0 ? 2 * precision() * recall() / sum : 0;
  }
  MeanScore& operator+=(const MeanScore& other);
};

/// Builds the model of a site measured by a device, and scores it.
MeanScore score_mean_site(SiteKind kind, Device device, std::uint64_t seed, const std::string& picture = "");

MeanScore score_model(const MeanSite& site, const MeanScan& scan, const semantic::BuiltModel& built);

/// What each of the model's objects is: the kind of the true one with most of its points; "no object" where
/// these lie on the building; empty where no true one is most of it.
std::vector<std::string> true_kinds(const MeanSite& site, const MeanScan& scan,
                                    const semantic::BuiltModel& built);

}  // namespace parhelion::test
