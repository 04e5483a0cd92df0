#include "tools/import/carmen_line.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include "protocols/angle_units.hpp"

namespace parhelion::tools {
namespace {

constexpr double kMaxBeams = 100'000;

/// Parses the words of a line in order; keeps the first error.
class Tokens {
 public:
  explicit Tokens(std::string_view line) {
    constexpr std::string_view blank = " \t\r";
    for (std::size_t at = line.find_first_not_of(blank); at != std::string_view::npos;
         at = line.find_first_not_of(blank, at)) {
      const std::size_t end = std::min(line.find_first_of(blank, at), line.size());
      tokens_.push_back(line.substr(at, end - at));
      at = end;
    }
  }
  std::string_view token() {
    if (next_ < tokens_.size()) return tokens_[next_++];
    damaged_ = true;
    fail("the line ends after " + std::to_string(tokens_.size()) + " words");
    return {};
  }
  bool at_end() const { return next_ == tokens_.size(); }
  double number(const char* what) {
    const std::string_view text = token();
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
    if (value >= 0 && value <= kMaxBeams && value == std::floor(value))
      return static_cast<std::size_t>(value);
    fail(std::string(what) + " is not a count");
    return 0;
  }
  /// All numbers must be present before any is read, so that a wrong count is found at once.
  bool expect_tokens(std::size_t total) {
    if (tokens_.size() != total) {
      damaged_ = true;
      fail(std::to_string(total) + " words were expected, " + std::to_string(tokens_.size()) + " are there");
    }
    return ok();
  }
  void fail(std::string what) {
    if (error_.empty()) error_ = std::move(what);
  }
  bool ok() const { return error_.empty(); }
  const std::string& error() const { return error_; }
  bool empty() const { return tokens_.empty(); }
  /// The number of words is wrong.
  bool damaged() const { return damaged_; }

 private:
  std::vector<std::string_view> tokens_;
  std::size_t next_ = 0;
  std::string error_;
  bool damaged_ = false;
};

template <class A, class B>
Transform<A, B> planar_pose(Tokens& tokens) {
  const double x = tokens.number("x"), y = tokens.number("y"), theta = tokens.number("theta");
  return Transform<A, B>::planar(x, y, theta);
}

SensorTime stamp(Tokens& tokens) {
  constexpr double latest = 9.2e9;  // s; later times do not fit in nanoseconds
  const double seconds = tokens.number("ipc_timestamp");
  if (seconds < 0 || seconds > latest) {
    tokens.fail("ipc_timestamp is outside 1970..2260");
    return {};
  }
  return SensorTime::from_utime(std::llround(seconds * 1e6));
}

std::vector<float> floats(Tokens& tokens, std::size_t n, const char* what) {
  std::vector<float> values(n);
  for (float& value : values) value = static_cast<float>(tokens.number(what));
  return values;
}

Result<CarmenLine> done(const Tokens& tokens, CarmenLine line) {
  if (!tokens.ok()) return Error{tokens.error()};
  return line;
}

/// kind n ranges laser_pose(3) odom_pose(3) ipc_timestamp host logger_timestamp
Result<CarmenLine> parse_old_laser(const std::string& kind, Tokens& tokens) {
  CarmenLaser laser;
  laser.kind = kind;
  const std::size_t n = tokens.count("num_readings");
  if (!tokens.ok() || !tokens.expect_tokens(n + 11)) return Error{tokens.error()};
  if (n < 2) return Error{"a scan of " + std::to_string(n) + " beams has no angle step"};
  laser.scan.ranges = floats(tokens, n, "range");
  laser.T_odom_laser = planar_pose<Odom, Laser>(tokens);
  laser.T_odom_base = planar_pose<Odom, Base>(tokens);
  laser.scan.stamp = stamp(tokens);
  const std::size_t intervals = n % 2 == 0 ? n : n - 1;
  laser.scan.angle_min = static_cast<float>(-90 * kRadiansPerDegree);
  laser.scan.angle_increment = static_cast<float>(180 * kRadiansPerDegree / static_cast<double>(intervals));
  laser.statement = kind + " of " + std::to_string(n) + " readings, angles implied: -90 degrees and up";
  return done(tokens, std::move(laser));
}

/// kind type start_angle fov resolution max_range accuracy remission_mode n ranges m remissions laser_pose(3)
/// robot_pose(3) tv rv forward_safety side_safety turn_axis ipc_timestamp host logger_timestamp
Result<CarmenLine> parse_robot_laser(const std::string& kind, Tokens& tokens) {
  CarmenLaser laser;
  laser.kind = kind;
  const double type = tokens.number("laser_type");
  laser.scan.angle_min = static_cast<float>(tokens.number("start_angle"));
  const double field_of_view = tokens.number("fov");
  laser.scan.angle_increment = static_cast<float>(tokens.number("angular_resolution"));
  laser.range_max = static_cast<float>(tokens.number("maximum_range"));
  const double accuracy = tokens.number("accuracy"), remission_mode = tokens.number("remission_mode");
  const std::size_t n = tokens.count("num_readings");
  if (!tokens.ok()) return Error{tokens.error()};
  laser.scan.ranges = floats(tokens, n, "range");
  const std::size_t remissions = tokens.count("num_remissions");
  if (!tokens.ok() || !tokens.expect_tokens(n + remissions + 24)) return Error{tokens.error()};
  laser.scan.intensities = floats(tokens, remissions, "remission");
  if (remissions != n) {
    if (remissions != 0)
      return Error{std::to_string(remissions) + " remissions for " + std::to_string(n) + " ranges"};
    laser.scan.intensities.clear();
  }
  laser.T_odom_laser = planar_pose<Odom, Laser>(tokens);
  laser.T_odom_base = planar_pose<Odom, Base>(tokens);
  for (int unused = 0; unused < 5; ++unused) tokens.number("velocity or safety distance");
  laser.scan.stamp = stamp(tokens);
  laser.statement = kind + ": laser_type " + std::to_string(std::lround(type)) + ", fov " +
                    std::to_string(field_of_view) + " rad, maximum_range " + std::to_string(laser.range_max) +
                    " m, accuracy " + std::to_string(accuracy) + " m, remission_mode " +
                    std::to_string(std::lround(remission_mode));
  return done(tokens, std::move(laser));
}

Result<CarmenLine> parse_odometry(Tokens& tokens) {
  if (!tokens.expect_tokens(10)) return Error{tokens.error()};
  CarmenOdometry odometry;
  odometry.odometry.T_odom_base = planar_pose<Odom, Base>(tokens);
  for (int unused = 0; unused < 3; ++unused) tokens.number("tv, rv or accel");
  odometry.odometry.stamp = stamp(tokens);
  return done(tokens, odometry);
}

Result<CarmenLine> parse_true_pose(Tokens& tokens) {
  if (!tokens.expect_tokens(10)) return Error{tokens.error()};
  CarmenTruePose truth;
  truth.pose.T_map_base = planar_pose<Map, Base>(tokens);
  planar_pose<Odom, Base>(tokens);
  truth.pose.stamp = stamp(tokens);
  return done(tokens, truth);
}

Result<CarmenLine> parse_tokens(Tokens& tokens) {
  if (tokens.empty()) return CarmenLine(CarmenOther{"#"});
  const std::string kind(tokens.token());
  if (kind.starts_with("#")) return CarmenLine(CarmenOther{"#"});
  if (kind == "FLASER" || kind == "RLASER") return parse_old_laser(kind, tokens);
  if (kind.starts_with("ROBOTLASER")) return parse_robot_laser(kind, tokens);
  if (kind == "ODOM") return parse_odometry(tokens);
  if (kind == "TRUEPOS") return parse_true_pose(tokens);
  if (kind == "PARAM") {
    CarmenParameter parameter{std::string(tokens.token()), {}};
    if (!tokens.at_end()) parameter.value = tokens.token();
    return done(tokens, std::move(parameter));
  }
  return CarmenLine(CarmenOther{kind.substr(0, 40)});
}

}  // namespace

Result<CarmenLine> parse_carmen_line(std::string_view line, bool& damaged) {
  Tokens tokens(line);
  auto parsed = parse_tokens(tokens);
  damaged = !parsed && tokens.damaged();
  return parsed;
}

bool is_cut_carmen_kind(std::string_view line) {
  constexpr std::string_view kinds[] = {"FLASER", "RLASER", "ROBOTLASER1", "ODOM", "TRUEPOS", "PARAM"};
  return !line.empty() && std::any_of(std::begin(kinds), std::end(kinds), [&](std::string_view kind) {
    return line.size() < kind.size() && kind.starts_with(line);
  });
}

}  // namespace parhelion::tools
