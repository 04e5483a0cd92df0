#include "tools/import/laser_evidence.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "protocols/angle_units.hpp"
#include "protocols/channel_map.hpp"
#include "protocols/length_text.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::tools {
namespace {

struct KnownLaser {
  const char* preset;
  double field_of_view, step;  ///< degrees
};
constexpr KnownLaser kKnownLasers[] = {
    {"lms-200", 180, 0.5}, {"lms-200", 180, 1}, {"s3000", 190, 0.25}, {"utm-30lx", 270, 0.25}};

/// Assumed footprint: as wide as a trolley, reaching back half of that, and forward to the laser.
std::vector<Eigen::Vector2d> assumed_footprint(const LaserDescription* laser) {
  constexpr double half_width = 0.3;
  const Eigen::Vector3d p = laser ? laser->T_base_laser.translation() : Eigen::Vector3d(0, 0, 0);
  const double front = std::max(half_width, p.x() + 0.05), back = std::min(-half_width, p.x() - 0.05);
  return {{back, -half_width}, {front, -half_width}, {front, half_width}, {back, half_width}};
}

}  // namespace

std::string recognise_preset(std::size_t beams, double angle_increment) {
  const double step = std::abs(angle_increment) / kRadiansPerDegree;
  for (const KnownLaser& laser : kKnownLasers) {
    // The stated field of view may include one beam too many ("180 beams of 1 degree").
    const double intervals = laser.field_of_view / laser.step;
    const bool count_fits = std::abs(static_cast<double>(beams) - 0.5 - intervals) < 1;
    if (count_fits && std::abs(step - laser.step) < 0.01 * laser.step) return laser.preset;
  }
  return {};
}

std::string joined(const std::vector<std::string>& notes) {
  std::string text;
  for (const std::string& note : notes) text += (text.empty() ? "" : "; ") + note;
  return text;
}

void LaserEvidence::add(const Scan& scan) {
  ++shapes_[{scan.ranges.size(), scan.angle_min, scan.angle_increment}];
  if (last_ && scan.stamp > *last_) intervals_.push_back((scan.stamp - *last_).ns);
  last_ = scan.stamp;
  for (const float range : scan.ranges) {
    if (std::isnan(range)) {
      ++nans_;
    } else if (std::isinf(range)) {
      infinities_ += range > 0;
    } else if (range == 0) {
      ++zeros_;
    } else if (range_max > 0 && range >= range_max) {
      ++beyond_[range];
    } else if (range > 0) {
      // Without a stated maximum, the longest range that repeats is the sensor's value for no return.
      if (range_max == 0 && range >= longest_) {
        if (range > longest_) beyond_.clear();
        ++beyond_[range];
      }
      longest_ = std::max(longest_, range);
      shortest_ = shortest_ > 0 ? std::min(shortest_, range) : range;
    }
  }
}

LaserEvidence::Shape LaserEvidence::most_common_shape() const {
  const auto largest = std::max_element(shapes_.begin(), shapes_.end(),
                                        [](const auto& a, const auto& b) { return a.second < b.second; });
  return largest == shapes_.end() ? Shape{} : largest->first;
}

RangeConvention LaserEvidence::convention(std::vector<std::string>& notes) const {
  using Sentinel = RangeConvention::Sentinel;
  RangeConvention convention;
  convention.range_min = range_min;
  convention.range_max = range_max;
  if (range_max <= 0) {
    convention.range_max = longest_;
    notes.push_back("maximum range is the longest observed, " + length_text(longest_) +
                    "; give the description the sensor's own");
  }
  std::uint64_t largest = 0;
  const auto candidate = [&](std::uint64_t count, Sentinel kind, float value) {
    if (count <= largest) return;
    largest = count;
    convention.no_return = kind;
    convention.no_return_value = value;
  };
  candidate(infinities_, Sentinel::infinity, 0);
  candidate(zeros_, Sentinel::value, 0);
  candidate(nans_, Sentinel::nan, 0);
  for (const auto& [value, count] : beyond_) candidate(count, Sentinel::value, value);
  return convention;
}

Result<LaserDescription> LaserEvidence::describe(const ImportOptions& options,
                                                 std::vector<std::string>& notes) const {
  const Shape shape = most_common_shape();
  LaserDescription laser;
  std::string preset = options.laser_preset;
  if (preset == "auto") preset = recognise_preset(shape.beams, shape.angle_increment);
  if (!preset.empty() && preset != "none") {
    const auto loaded = load_laser_preset(preset);
    if (!loaded && options.laser_preset != "auto") return loaded.error();
    if (loaded) {
      laser = *loaded;
      laser.preset = preset;
      if (options.laser_preset == "auto") notes.push_back("laser recognized as " + preset + " by its beams");
    } else {
      notes.push_back("preset " + preset + " not found: noise and beam timing are unknown");
    }
  }
  const float preset_range_min = laser.convention.range_min;
  laser.convention = convention(notes);
  if (laser.convention.range_min <= 0) {
    laser.convention.range_min = shortest_ > 0 ? std::min(preset_range_min, shortest_) : preset_range_min;
  }
  laser.T_base_laser = T_base_laser.value_or(Transform<Base, Laser>());
  if (!T_base_laser) notes.push_back("the laser's pose is not in the source: assumed above base_link");
  if (!height_known) {
    notes.push_back("the laser's height is not in the source: " + length_text(options.laser_height) +
                    " assumed");
    const Eigen::Vector3d p = laser.T_base_laser.translation();
    laser.T_base_laser = {laser.T_base_laser.quaternion(), {p.x(), p.y(), options.laser_height}};
  }
  // A single pass of half a degree is the interlaced mode; coarser scans are a single pass.
  if (laser.passes > 1 && std::abs(shape.angle_increment) > 0.75 * kRadiansPerDegree) {
    laser.passes = 1;
    laser.pass_period = 0;
  }
  if (stamp_beam) laser.stamp_beam = *stamp_beam;
  if (beam_interval > 0) {
    laser.beam_interval = beam_interval;
    laser.passes = 1;
    laser.pass_period = 0;
  }
  if (noise_sigma > 0) laser.noise_sigma = noise_sigma;
  laser.scan_period = scan_period;
  if (scan_period <= 0 && !intervals_.empty()) {
    laser.scan_period = static_cast<double>(median(std::vector<std::int64_t>(intervals_))) * 1e-9;
  }
  laser.beams = static_cast<int>(shape.beams);
  laser.angle_min = shape.angle_min;
  laser.angle_increment = shape.angle_increment;
  laser.source = source;
  return laser;
}

std::string robot_name(const ImportOptions& options) {
  std::string name =
      options.robot_name.empty() ? options.input.lexically_normal().filename().string() : options.robot_name;
  if (options.robot_name.empty()) name = name.substr(0, name.find('.'));
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '_' && c != '-') c = '_';
  }
  return name.empty() ? "robot" : name.substr(0, kMaxRobotName);
}

RobotDescription describe_robot(const ImportOptions& options, std::optional<LaserDescription> laser,
                                std::vector<std::string>& notes) {
  RobotDescription robot;
  robot.name = robot_name(options);
  robot.footprint = assumed_footprint(laser ? &*laser : nullptr);
  robot.laser = std::move(laser);
  notes.push_back("footprint, height, mass and limits are not in the source: assumed");
  robot.source = "imported from " + options.input.filename().string();
  return robot;
}

}  // namespace parhelion::tools
