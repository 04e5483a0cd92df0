#include "tools/import/carmen_line.hpp"

#include <charconv>
#include <cmath>
#include <numbers>
#include <vector>

namespace parhelion::tools {
namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double most_beams = 100'000;

/// Parses the words of a line in order; keeps the first error.
class Words {
 public:
  explicit Words(std::string_view line) {
    constexpr std::string_view blank = " \t\r";
    for (std::size_t at = line.find_first_not_of(blank); at != std::string_view::npos;
         at = line.find_first_not_of(blank, at)) {
      const std::size_t end = std::min(line.find_first_of(blank, at), line.size());
      words_.push_back(line.substr(at, end - at));
      at = end;
    }
  }
  std::string_view word() {
    if (next_ < words_.size()) return words_[next_++];
    fail("the line ends after " + std::to_string(words_.size()) + " words");
    return {};
  }
  double number(const char* what) {
    const std::string_view text = word();
    double value = 0;
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (code != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
      fail("word " + std::to_string(next_) + " (" + what + ") is '" + std::string(text.substr(0, 40)) +
           "', expected a number");
    }
    return value;
  }
  std::size_t count(const char* what) {
    const double value = number(what);
    if (value >= 0 && value <= most_beams && value == std::floor(value))
      return static_cast<std::size_t>(value);
    fail(std::string(what) + " is not a count");
    return 0;
  }
  /// All numbers must be present before any is read, so that a wrong count is found at once.
  bool expect_words(std::size_t total) {
    if (words_.size() != total) {
      fail(std::to_string(total) + " words were expected, " + std::to_string(words_.size()) + " are there");
    }
    return ok();
  }
  void fail(std::string what) {
    if (error_.empty()) error_ = std::move(what);
  }
  bool ok() const { return error_.empty(); }
  const std::string& error() const { return error_; }
  bool empty() const { return words_.empty(); }

 private:
  std::vector<std::string_view> words_;
  std::size_t next_ = 0;
  std::string error_;
};

template <class A, class B>
Transform<A, B> planar_pose(Words& words) {
  const double x = words.number("x"), y = words.number("y"), theta = words.number("theta");
  return Transform<A, B>::planar(x, y, theta);
}

SensorTime stamp(Words& words) {
  constexpr double latest = 9.2e9;  // s; later times do not fit in nanoseconds
  const double seconds = words.number("ipc_timestamp");
  if (seconds < 0 || seconds > latest) {
    words.fail("ipc_timestamp is outside 1970..2260");
    return {};
  }
  return SensorTime::from_utime(std::llround(seconds * 1e6));
}

std::vector<float> floats(Words& words, std::size_t n, const char* what) {
  std::vector<float> values(n);
  for (float& value : values) value = static_cast<float>(words.number(what));
  return values;
}

Result<CarmenLine> done(const Words& words, CarmenLine line) {
  if (!words.ok()) return Error{words.error()};
  return line;
}

/// kind n ranges laser_pose(3) odom_pose(3) ipc_timestamp host logger_timestamp
Result<CarmenLine> parse_old_laser(const std::string& kind, Words& words) {
  CarmenLaser laser;
  laser.kind = kind;
  const std::size_t n = words.count("num_readings");
  if (!words.ok() || !words.expect_words(n + 11)) return Error{words.error()};
  if (n < 2) return Error{"a scan of " + std::to_string(n) + " beams has no angle step"};
  laser.scan.ranges = floats(words, n, "range");
  laser.T_odom_laser = planar_pose<Odom, Laser>(words);
  laser.T_odom_base = planar_pose<Odom, Base>(words);
  laser.scan.stamp = stamp(words);
  const std::size_t intervals = n % 2 == 0 ? n : n - 1;
  laser.scan.angle_first = static_cast<float>(-90 * degree);
  laser.scan.angle_step = static_cast<float>(180 * degree / static_cast<double>(intervals));
  laser.statement = kind + " of " + std::to_string(n) + " readings, angles implied: -90 degrees and up";
  return done(words, std::move(laser));
}

/// kind type start_angle fov resolution max_range accuracy remission_mode n ranges m remissions laser_pose(3)
/// robot_pose(3) tv rv forward_safety side_safety turn_axis ipc_timestamp host logger_timestamp
Result<CarmenLine> parse_robot_laser(const std::string& kind, Words& words) {
  CarmenLaser laser;
  laser.kind = kind;
  const double type = words.number("laser_type");
  laser.scan.angle_first = static_cast<float>(words.number("start_angle"));
  const double field_of_view = words.number("fov");
  laser.scan.angle_step = static_cast<float>(words.number("angular_resolution"));
  laser.range_max = static_cast<float>(words.number("maximum_range"));
  const double accuracy = words.number("accuracy"), remission_mode = words.number("remission_mode");
  const std::size_t n = words.count("num_readings");
  if (!words.ok()) return Error{words.error()};
  laser.scan.ranges = floats(words, n, "range");
  const std::size_t remissions = words.count("num_remissions");
  if (!words.ok() || !words.expect_words(n + remissions + 24)) return Error{words.error()};
  laser.scan.intensities = floats(words, remissions, "remission");
  if (remissions != n) {
    if (remissions != 0)
      return Error{std::to_string(remissions) + " remissions for " + std::to_string(n) + " ranges"};
    laser.scan.intensities.clear();
  }
  laser.T_odom_laser = planar_pose<Odom, Laser>(words);
  laser.T_odom_base = planar_pose<Odom, Base>(words);
  for (int unused = 0; unused < 5; ++unused) words.number("velocity or safety distance");
  laser.scan.stamp = stamp(words);
  laser.statement = kind + ": laser_type " + std::to_string(std::lround(type)) + ", fov " +
                    std::to_string(field_of_view) + " rad, maximum_range " + std::to_string(laser.range_max) +
                    " m, accuracy " + std::to_string(accuracy) + " m, remission_mode " +
                    std::to_string(std::lround(remission_mode));
  return done(words, std::move(laser));
}

Result<CarmenLine> parse_odometry(Words& words) {
  if (!words.expect_words(10)) return Error{words.error()};
  CarmenOdometry odometry;
  odometry.odometry.T_odom_base = planar_pose<Odom, Base>(words);
  for (int unused = 0; unused < 3; ++unused) words.number("tv, rv or accel");
  odometry.odometry.stamp = stamp(words);
  return done(words, odometry);
}

Result<CarmenLine> parse_true_pose(Words& words) {
  if (!words.expect_words(10)) return Error{words.error()};
  CarmenTruePose truth;
  truth.pose.T_map_base = planar_pose<Map, Base>(words);
  planar_pose<Odom, Base>(words);
  truth.pose.stamp = stamp(words);
  return done(words, truth);
}

}  // namespace

Result<CarmenLine> parse_carmen_line(std::string_view line) {
  Words words(line);
  if (words.empty()) return CarmenLine(CarmenOther{"#"});
  const std::string kind(words.word());
  if (kind.starts_with("#")) return CarmenLine(CarmenOther{"#"});
  if (kind == "FLASER" || kind == "RLASER") return parse_old_laser(kind, words);
  if (kind.starts_with("ROBOTLASER")) return parse_robot_laser(kind, words);
  if (kind == "ODOM") return parse_odometry(words);
  if (kind == "TRUEPOS") return parse_true_pose(words);
  if (kind == "PARAM") {
    CarmenParameter parameter{std::string(words.word()), {}};
    parameter.value = words.word();
    return done(words, std::move(parameter));
  }
  return CarmenLine(CarmenOther{kind.substr(0, 40)});
}

}  // namespace parhelion::tools
