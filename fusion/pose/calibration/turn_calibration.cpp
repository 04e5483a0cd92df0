#include "fusion/pose/calibration/turn_calibration.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>

#include "fusion/pose/calibration/turn_fit.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::pose {
namespace {

constexpr double kMinTurned = 1;  ///< rad: less says nothing of the sensor
constexpr std::size_t kGroups = 16;

/// What is known worse than this (1 sigma) is left as it was: about what a data sheet gives.
const TurnSigmas kUseful(0.01, 0.02, 0.005);

constexpr std::array<const char*, kTurnParameters> kNames{"time offset", "scale", "bias"};
constexpr std::array<const char*, kTurnParameters> kWhichDrive{
    "turn on the spot both ways, starting and stopping briskly, ten times or more",
    "turn on the spot by a full turn and back", "stand still for ten seconds, and turn both ways"};

/// The spread of fits that each leave out a part of the drive (delete-a-group jackknife, Efron 1982): errors
/// that last for many scans are in it.
TurnSigmas jackknife(const std::vector<TurnWindow>& windows, const TurnFit& fit, const TurnFree& free) {
  std::vector<TurnFit> each;
  const std::size_t groups = std::min(kGroups, windows.size());
  for (std::size_t g = 0; g < groups; ++g) {
    std::vector<TurnWindow> rest = windows;
    const auto begin = rest.begin();
    rest.erase(begin + static_cast<std::ptrdiff_t>(g * windows.size() / groups),
               begin + static_cast<std::ptrdiff_t>((g + 1) * windows.size() / groups));
    if (const auto fitted = fit_turns(rest, fit.values, free)) each.push_back(*fitted);
  }
  TurnSigmas sigmas = TurnSigmas::Zero();
  if (each.size() < 2) return sigmas;
  const auto count = static_cast<double>(each.size());
  TurnSigmas mean = TurnSigmas::Zero();
  for (const TurnFit& f : each) mean += f.values / count;
  for (const TurnFit& f : each) sigmas += (f.values - mean).cwiseAbs2();
  return ((count - 1) / count * sigmas).cwiseSqrt();
}

/// The free quantity that is known worst, where it is worse than useful.
std::optional<std::size_t> worst(const TurnSigmas& sigmas, const TurnFree& free) {
  std::optional<std::size_t> found;
  double largest = 1;
  for (std::size_t k = 0; k < kTurnParameters; ++k) {
    const double ratio = sigmas[static_cast<Eigen::Index>(k)] / kUseful[static_cast<Eigen::Index>(k)];
    if (free[k] && !(ratio <= largest)) largest = ratio, found = k;
  }
  return found;
}

struct Shown {
  TurnFit fit;
  TurnSigmas sigmas;
  TurnFree free;
};

/// Fixes what the drive does not show, one quantity after the other.
std::optional<Shown> fit_what_is_shown(const std::vector<TurnWindow>& windows, const TurnStart& start) {
  TurnFree free{true, true, start.measures_rates};
  const TurnValues before(start.time_offset, 1, 0);
  TurnValues rough = before;
  rough[0] = rough_offset(windows, start.time_offset);
  for (;;) {
    const auto fit = fit_turns(windows, rough, free);
    if (!fit) return std::nullopt;
    TurnSigmas sigmas = fit->sigmas;
    if (!worst(sigmas, free)) sigmas = sigmas.cwiseMax(jackknife(windows, *fit, free));
    const auto unseen = worst(sigmas, free);
    if (!unseen) return Shown{*fit, sigmas, free};
    free[*unseen] = false;
    rough[static_cast<Eigen::Index>(*unseen)] = before[static_cast<Eigen::Index>(*unseen)];
  }
}

double turned(const std::vector<TurnWindow>& windows) {
  double sum = 0;
  for (const TurnWindow& window : windows) {
    for (std::size_t k = 1; k < window.heading.size(); ++k)
      sum += std::abs(window.heading[k] - window.heading[k - 1]);
  }
  return sum;
}

/// Turns that are not those of the robot's base.
std::string contradiction(const std::vector<TurnWindow>& windows, const std::string& sensor) {
  const double slope = turn_ratio(windows, rough_offset(windows, 0));
  if (slope < 0.5 && turn_ratio(windows, 0) < -0.5)
    return "the " + sensor + " turns the other way than the scans: is its pose upside down?";
  if (slope < 0.5)
    return "the " + sensor + " does not turn as the scans do, " + std::to_string(slope) +
           " times their turns: is its pose right, and is it of the same drive?";
  return {};
}

}  // namespace

Result<TurnCalibration> calibrate_turns(const std::vector<LaserPose>& laser, const TurnPath& sensor,
                                        const TurnStart& start) {
  const std::vector<TurnWindow> windows = turn_windows(laser, sensor);
  TurnCalibration result;
  for (const TurnWindow& window : windows) result.poses += window.heading.size();
  result.turned = turned(windows);
  if (windows.size() < 4) {
    return Error{"the " + start.sensor + " was on at " + std::to_string(result.poses) +
                 " scans in a row only: are its stamps and those of the scans of one clock?"};
  }
  if (result.turned >= kMinTurned) {
    if (std::string why = contradiction(windows, start.sensor); !why.empty()) return Error{std::move(why)};
  }
  const auto fitted = fit_what_is_shown(windows, start);
  if (!fitted) return Error{"the " + start.sensor + " and the scans cannot be brought together"};
  const std::array<Measured*, kTurnParameters> measured{&result.time_offset, &result.scale, &result.bias};
  for (std::size_t k = 0; k < kTurnParameters; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    *measured[k] = {fitted->fit.values[i], fitted->sigmas[i], fitted->free[k]};
    if (!fitted->free[k] && (k == 0 || start.measures_rates))
      result.advice.push_back(start.sensor + "'s " + kNames[k] +
                              " is not shown by this drive: " + kWhichDrive[k]);
  }
  result.heading_sigma = fitted->fit.noise.heading;
  result.jitter = fitted->fit.noise.jitter;
  result.outliers = fitted->fit.outliers;
  return result;
}

}  // namespace parhelion::pose
