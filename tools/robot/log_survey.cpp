#include "tools/robot/log_survey.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <type_traits>

#include "fusion/pose/matching/beam_order.hpp"
#include "protocols/bus/log_file.hpp"
#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::tools {
namespace {

constexpr std::size_t kMaxScans = 2000;
constexpr double kRepeated = 0.005;  // minimum fraction of ranges that makes a value no return
constexpr double kSpeedSpan = 0.5;   // s over which a speed is measured

double median_period(std::vector<SensorTime> stamps) {
  std::vector<double> periods;
  for (std::size_t i = 1; i < stamps.size(); ++i) periods.push_back((stamps[i] - stamps[i - 1]).seconds());
  std::erase_if(periods, [](double period) { return !(period > 0); });
  if (periods.empty()) return 0;
  return median(std::move(periods));
}

template <class Message>
class Collected {
 public:
  void add(const parhelion::Message& message, std::vector<std::string>& findings) {
    Message decoded;
    if (const Status status = decode(message.channel, message.payload, decoded); !status) {
      if (!failed_) findings.push_back(status.error().message);
      failed_ = true;
      return;
    }
    if constexpr (std::is_same_v<Message, Image>) decoded.bytes = {};  // an hour of pictures fills the memory
    times.add(decoded.stamp, message.arrival);
    messages.push_back(std::move(decoded));
  }
  std::vector<Message> messages;
  Arrivals times;

 private:
  bool failed_ = false;
};

/// Number of beams, angle of the first and between two, of most scans.
struct Form {
  std::size_t beams;
  float angle_min, angle_increment;
  auto operator<=>(const Form&) const = default;
};

/// Scans with angles of their own are all of one form.
Form form_of(const Scan& scan) {
  return scan.angles.empty() ? Form{scan.ranges.size(), scan.angle_min, scan.angle_increment} : Form{};
}

Form usual_form(const std::vector<Scan>& scans) {
  std::map<Form, std::size_t> counts;
  for (const Scan& scan : scans) ++counts[form_of(scan)];
  return std::max_element(counts.begin(), counts.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

/// Fills what the values of the ranges show.
void survey_ranges(LaserSurvey& survey) {
  std::map<float, std::size_t> counts;  // of finite ranges > 0
  std::size_t all = 0, zero = 0, nan = 0, infinite = 0;
  for (const Scan& scan : survey.scans) {
    for (const float range : scan.ranges) {
      ++all;
      zero += range == 0;
      nan += std::isnan(range);
      infinite += std::isinf(range);
      if (std::isfinite(range) && range > 0) ++counts[range];
    }
  }
  const auto fraction = [all](std::size_t count) {
    return static_cast<double>(count) / static_cast<double>(all);
  };
  survey.zero = fraction(zero);
  survey.nan = fraction(nan);
  survey.infinite = fraction(infinite);
  if (counts.empty()) return;
  const auto last = std::prev(counts.end());
  if (counts.size() > 1 && fraction(last->second) > kRepeated) {
    survey.repeated = last->first;
    survey.repeated_fraction = fraction(last->second);
    counts.erase(last);
  }
  survey.min_range = counts.begin()->first;
  survey.max_range = counts.rbegin()->first;
}

LaserSurvey survey_laser(std::vector<Scan> scans, const std::vector<SensorTime>& stamps) {
  LaserSurvey survey;
  const Form form = usual_form(scans);
  const auto usual =
      std::find_if(scans.begin(), scans.end(), [&](const Scan& scan) { return form_of(scan) == form; });
  survey.beams = usual->ranges.size();
  survey.angle_min = usual->angle_min;
  survey.angle_increment = usual->angle_increment;
  survey.own_angles = !usual->angles.empty();
  survey.period = median_period(stamps);
  for (std::size_t i = 1; i < stamps.size(); ++i) survey.backward_stamps += stamps[i] < stamps[i - 1];
  const std::size_t before = scans.size();
  std::erase_if(scans, [&](const Scan& scan) { return form_of(scan) != form; });
  survey.odd_scans = before - scans.size();
  if (scans.size() > kMaxScans) scans.resize(kMaxScans);
  survey.intensities = !scans.front().intensities.empty();
  survey.scans = std::move(scans);
  survey_ranges(survey);
  return survey;
}

double percentile_99(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, values.size() * 99 / 100)];
}

OdometrySurvey survey_odometry(std::vector<Odometry> samples) {
  OdometrySurvey survey;
  for (Odometry& sample : samples) {
    if (survey.samples.empty() || sample.stamp > survey.samples.back().stamp)
      survey.samples.push_back(std::move(sample));
  }
  std::vector<double> speeds, rates;
  for (std::size_t i = 0, k = 0; i < survey.samples.size(); ++i) {
    const Odometry& now = survey.samples[i];
    while (k < i && (now.stamp - survey.samples[k + 1].stamp).seconds() >= kSpeedSpan) ++k;
    const Odometry& then = survey.samples[k];
    const double dt = (now.stamp - then.stamp).seconds();
    if (dt < kSpeedSpan || dt > 3 * kSpeedSpan) continue;
    const auto T_then_now = then.T_odom_base.inverse() * now.T_odom_base;
    speeds.push_back(T_then_now.translation().norm() / dt);
    rates.push_back(std::abs(std::atan2(T_then_now.rotation()(1, 0), T_then_now.rotation()(0, 0))) / dt);
  }
  survey.speed = percentile_99(std::move(speeds));
  survey.yaw_rate = percentile_99(std::move(rates));
  return survey;
}

ImageSurvey survey_images(const Collected<Image>& images) {
  const Image& first = images.messages.front();
  return {images.messages.size(), first.width, first.height, median_period(images.times.stamps)};
}

}  // namespace

Result<LogSurvey> survey_log(const std::string& path) {
  auto reader = LogReader::open(path);
  if (!reader) return reader.error();
  LogSurvey survey;
  survey.path = path;
  std::map<std::string, Collected<Scan>> scans;  // by channel
  Collected<Odometry> odometry;
  Collected<Image> camera, depth;
  Collected<ImuSample> imu;
  std::set<std::string> joints;
  Joints state;
  RobotMessage robot;
  for (;;) {
    const auto message = reader->next();
    if (!message) {
      if (survey.findings.size() < 20) survey.findings.push_back(message.error().message);
      continue;
    }
    if (!*message) break;
    const std::string& name = (*message)->channel;
    const SensorChannel parts = parse_sensor_channel(name);
    if (name == channel::kScan || (parts.canonical == channel::kScan && !parts.sensor.empty()))
      scans[name].add(**message, survey.findings);
    if (name == channel::kOdometry) odometry.add(**message, survey.findings);
    if (name == channel::kCamera) camera.add(**message, survey.findings);
    if (name == channel::kDepth) depth.add(**message, survey.findings);
    if (!name.starts_with("MR_") && !parts.sensor.empty()) survey.further.insert(name);
    if (name == channel::kImu) imu.add(**message, survey.findings);
    if (name == channel::kJointState && decode(name, (*message)->payload, state))
      joints.insert(state.names.begin(), state.names.end());
    if (name == channel::kRobot && decode(name, (*message)->payload, robot)) survey.robot_yaml = robot.yaml;
  }
  survey.joints.assign(joints.begin(), joints.end());
  survey.imu = !imu.messages.empty();
  survey.odometry_lag = lag_between(scans[channel::kScan].times, odometry.times);
  for (auto& [name, collected] : scans) {
    if (collected.messages.empty()) continue;
    LaserSurvey laser = survey_laser(std::move(collected.messages), collected.times.stamps);
    laser.stamp_rate = stamp_rate(collected.times);
    laser.arrival = scan_arrival(collected.times, odometry.times);
    if (name == channel::kScan)
      survey.laser = std::move(laser);
    else
      survey.further_lasers.emplace(name, std::move(laser));
  }
  if (odometry.messages.size() > 1) {
    survey.odometry = survey_odometry(std::move(odometry.messages));
    survey.odometry->stamp_rate = stamp_rate(odometry.times);
  }
  if (!camera.messages.empty()) survey.camera = survey_images(camera);
  if (!depth.messages.empty()) survey.depth = survey_images(depth);
  if (!survey.laser && !survey.odometry && !survey.camera && !survey.depth) {
    if (!survey.findings.empty())
      return Error{path + ": no sensor's event can be read: " + survey.findings[0]};
    return Error{
        path +
        ": expected messages on SCAN, ODOMETRY, CAMERA or DEPTH, found none; `parhelion topic list --log " +
        path + "` shows its channels"};
  }
  return survey;
}

LaserDescription laser_seen(const LaserSurvey& survey) {
  LaserDescription laser;
  RangeConvention& ranges = laser.convention;
  using Sentinel = RangeConvention::Sentinel;
  ranges.range_min = survey.min_range;
  ranges.range_max = std::nextafter(survey.max_range, std::numeric_limits<float>::infinity());
  if (survey.repeated) {
    ranges.no_return = Sentinel::value;
    ranges.no_return_value = *survey.repeated;
    ranges.range_max = *survey.repeated;
  } else if (survey.infinite >= survey.nan && survey.infinite >= survey.zero) {
    ranges.no_return = Sentinel::infinity;
  } else if (survey.nan >= survey.zero) {
    ranges.no_return = Sentinel::nan;
  } else {
    ranges.no_return = Sentinel::value;
    ranges.no_return_value = 0;
    ranges.too_close = Sentinel::nan;  // 0 has a meaning already
  }
  laser.scan_period = survey.period;
  laser.beam_interval = std::abs(double{survey.angle_increment}) / (2 * std::numbers::pi) * survey.period;
  laser.intensities = survey.intensities;
  laser.beams = static_cast<int>(survey.beams);
  laser.angle_min = survey.angle_min;
  laser.angle_increment = survey.angle_increment;
  pose::beam_order_of(survey.scans, laser).correct(laser);
  return laser;
}

}  // namespace parhelion::tools
