// Real scans with labelled people, from ROS 1 bags (a zip is unpacked on the way).
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "fusion/people/people_tracker.hpp"
#include "protocols/pose2.hpp"
#include "tests/fusion/people/evaluation.hpp"

namespace parhelion::test {

struct LabelledScan {
  Scan scan;
  SimulationTime stamp;
  Pose2 T_map_laser;  ///< from odometry where the bag has it; else the laser stands still
  bool labelled = false;
  std::vector<KnownPerson> people;  ///< in the laser's frame
};

struct Recording {
  LaserDescription laser;
  std::vector<LabelledScan> scans;
  bool complete = false;  ///< everybody is labelled, within `sector`
  double sector = 3.15;   ///< rad on each side of straight ahead
  double reach = 100;     ///< m
};

/// leg_tracker/Person labels (persons in the laser's frame, without a header: paired by log time).
Recording read_benchmark(const std::filesystem::path& bag_or_zip);
/// A bag of scans, and the one with the clusters of legs that its makers extracted. Labels are legs: two that
/// are near each other are one person.
Recording read_legs(const std::filesystem::path& scans, const std::filesystem::path& extracted);

PeopleScore score(const Recording& recording, const people::PeopleOptions& options = {});

}  // namespace parhelion::test
