// Made-up scans with known truth: people who walk on two legs or stand, furniture, poles, doorposts and
// glass, robots, seen by lasers of several kinds from a robot that drives and knows its pose with an error.
// Everything follows from the seed. The plane of the laser is level.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "fusion/people/laser_sweep.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::test {

/// A generator of random numbers that is the same on every machine.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed * 0x2545F4914F6CDD1DULL + 0x9E3779B97F4A7C15ULL) {}
  double uniform(double low = 0, double high = 1);
  double normal(double sigma = 1);
  bool chance(double p) { return uniform() < p; }
  int integer(int low, int high);  ///< both inclusive

 private:
  std::uint64_t state_;
};

struct LaserKind {
  int beams = 360;
  double field = 2 * 3.14159265358979;  ///< rad
  double rate = 10;                     ///< Hz
  double range_max = 12, range_min = 0.05;
  double noise = 0.01;      ///< m
  double quantization = 0;  ///< m
  double dropout = 0.002;   ///< fraction of beams
  double mixed = 0.3;       ///< fraction of the beams at an edge that measure something between
  double height = 0.2;      ///< m
  bool clockwise = false;
};

struct CrowdOptions {
  std::uint64_t seed = 1;
  double duration = 30;  ///< s
  int walkers = 4, standing = 1;
  int chairs = 6, tables = 2, poles = 4, boxes = 3, bins = 2;
  int robots = 1;
  double room = 12;   ///< m, width; its depth is between half of that and all of it
  bool open = false;  ///< no walls: outdoors
  bool glass = true;  ///< one wall returns every few beams only
  bool moving_laser = true;
  bool model = true;                            ///< the walls are modelled, the furniture is not
  double pose_noise = 0.01, pose_drift = 0.03;  ///< m, 1 sigma
  bool odometry =
      true;  ///< false: the laser is taken to stand still at the origin, whose frame the truth is in
  bool varied = false;  ///< with those below, long coats and all kinds of postures
  int aids = 0;         ///< who push something or sit in a wheelchair; some have a carer
  int seated = 0, groups = 0, leaning = 0;
  int seats = 0;  ///< tables with chairs
  LaserKind laser;
};

/// Options of every kind, drawn from the seed.
CrowdOptions random_crowd(std::uint64_t seed);
/// The same with wheelchairs, walking frames, prams and trolleys, long coats, who sit, lean at walls or stand
/// in groups, and lasers without odometry.
CrowdOptions varied_crowd(std::uint64_t seed);

struct TruePerson {
  int id = 0;
  Eigen::Vector2d position;
  Eigen::Vector2d velocity;
  int beams = 0;  ///< that hit this person in this scan
};

/// What beams hit.
enum class Source : std::uint8_t { nothing, building, furniture, person, robot, aid };

struct CrowdScan {
  Scan scan;
  SimulationTime stamp;                  ///< of its middle
  scan::LaserMotion estimated;           ///< what the server knows
  std::vector<scan::RangeHit> building;  ///< from the estimated pose; empty: no model
  std::vector<TruePerson> people;
  std::vector<Eigen::Vector2d> robots;
  std::vector<Source> source;  ///< for each beam
  Pose2 T_map_laser;           ///< true
};

struct Crowd {
  LaserDescription laser;
  std::vector<float> beam_time;
  double sigma = 0;  ///< m, of the poses
  std::vector<CrowdScan> scans;
};

Crowd make_crowd(const CrowdOptions& options);

}  // namespace parhelion::test
