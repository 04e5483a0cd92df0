#include "fusion/pose/mapping/wall_directions.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace parhelion::pose {
namespace {

constexpr double kRightAngle = std::numbers::pi / 2, kDegree = std::numbers::pi / 180;
constexpr double kGap = 0.5;          ///< m, between two points of a piece, at most
constexpr double kBeside = 0.06;      ///< m, of a point beside the line of the points before it, at most
constexpr double kLineFrom = 0.2;     ///< m, of points that have a line
constexpr double kShortest = 1.0;     ///< m, of a piece
constexpr std::size_t kFewest = 6;    ///< points of a piece
constexpr double kLongest = 5;        ///< m that a piece counts for, at most
constexpr int kReach = 6, kHalf = 2;  ///< bins: from a piece to its direction, and half the width of one
constexpr double kRecurring = 25;     ///< m, of pieces that make a direction,
constexpr double kRecurringFraction = 0.15;           ///< and of all
constexpr double kEnough = 2, kEnoughFraction = 0.6;  ///< m, and of all, of a scan's pieces that have one
constexpr double kCompared = 2;                       ///< m, of pieces between which angles are measured
constexpr double kLargestAngle = 7 * kDegree;         ///< beyond: another direction
constexpr double kLargestError = 2 * kDegree;         ///< that an angle counts for, as furniture has any
constexpr double kMinVariance = 0.2 * kDegree * 0.2 * kDegree;

/// Between -45 and 45 degrees.
double within_right_angle(double angle) { return angle - kRightAngle * std::round(angle / kRightAngle); }

/// The line through points that are added.
class GrowingLine {
 public:
  void add(const Eigen::Vector2d& p) {
    ++n_;
    sum_ += p;
    squares_ += p * p.transpose();
  }
  double direction() const {
    const Eigen::Vector2d mean = sum_ / n_;
    const Eigen::Matrix2d covariance = squares_ / n_ - mean * mean.transpose();
    return 0.5 * std::atan2(2 * covariance(0, 1), covariance(0, 0) - covariance(1, 1));
  }
  /// m
  double distance(const Eigen::Vector2d& p) const {
    const double angle = direction();
    const Eigen::Vector2d off = p - sum_ / n_;
    return std::abs(std::cos(angle) * off.y() - std::sin(angle) * off.x());
  }

 private:
  double n_ = 0;
  Eigen::Vector2d sum_ = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares_ = Eigen::Matrix2d::Zero();
};

}  // namespace

std::vector<WallPiece> wall_pieces(std::span<const Eigen::Vector2d> points) {
  std::vector<WallPiece> pieces;
  for (std::size_t first = 0; first + kFewest <= points.size();) {
    GrowingLine line;
    line.add(points[first]);
    std::size_t end = first + 1;
    for (; end < points.size() && (points[end] - points[end - 1]).norm() <= kGap; ++end) {
      const bool has_line = (points[end - 1] - points[first]).norm() > kLineFrom;
      if (has_line && line.distance(points[end]) > kBeside) break;
      line.add(points[end]);
    }
    const double length = (points[end - 1] - points[first]).norm();
    const bool found = end - first >= kFewest && length >= kShortest;
    if (found) pieces.push_back({line.direction(), std::min(length, kLongest)});
    // A run that is too short may have begun before a corner.
    first = found ? end : std::max(first + 1, end > first + kFewest ? end - 2 : 0);
  }
  return pieces;
}

void WallDirections::add(std::span<const WallPiece> pieces, double yaw) {
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const double turns = within_right_angle(pieces[i].direction + yaw) / kRightAngle;  // -0.5 to 0.5
    length_[static_cast<std::size_t>((turns + 1) * kBins) % kBins] += pieces[i].length;
    total_ += pieces[i].length;
    for (std::size_t j = 0; j < i; ++j) {
      const double length = std::min(pieces[i].length, pieces[j].length);
      const double angle = std::abs(within_right_angle(pieces[i].direction - pieces[j].direction));
      if (length < kCompared || angle > kLargestAngle) continue;
      const double error = std::min(angle, kLargestError);
      squared_angles_ += length * error * error;
      compared_ += length;
    }
  }
}

/// Both walls of an angle are off.
double WallDirections::variance() const {
  return kMinVariance + (compared_ > 0 ? squared_angles_ / compared_ / 2 : 0);
}

double WallDirections::sum_around(int bin) const {
  double sum = 0;
  for (int i = bin - kHalf; i <= bin + kHalf; ++i)
    sum += length_[static_cast<std::size_t>(i + int{kBins}) % kBins];
  return sum;
}

/// The direction within reach that most pieces have.
std::optional<double> WallDirections::recurring(double direction) const {
  const int at = static_cast<int>((within_right_angle(direction) / kRightAngle + 1) * kBins);
  int middle = at - kReach;
  for (int i = at - kReach; i <= at + kReach; ++i)
    if (sum_around(i) > sum_around(middle)) middle = i;
  const double length = sum_around(middle);
  if (length < std::max(kRecurring, kRecurringFraction * total_)) return std::nullopt;
  double moment = 0;
  for (int i = middle - kHalf; i <= middle + kHalf; ++i)
    moment += (i + 0.5) * length_[static_cast<std::size_t>(i) % kBins];
  return moment / length * kRightAngle / kBins;
}

std::optional<double> WallDirections::turned(std::span<const WallPiece> pieces, double yaw) const {
  double all = 0, enough = 0, sum = 0;
  for (const WallPiece& piece : pieces) {
    all += piece.length;
    const auto direction = recurring(piece.direction + yaw);
    if (!direction) continue;
    enough += piece.length;
    sum += piece.length * within_right_angle(piece.direction + yaw - *direction);
  }
  if (enough < std::max(kEnough, kEnoughFraction * all)) return std::nullopt;
  return sum / enough;
}

}  // namespace parhelion::pose
