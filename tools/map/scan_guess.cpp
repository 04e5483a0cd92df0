#include "tools/map/scan_guess.hpp"

#include <cmath>
#include <fstream>
#include <numbers>
#include <optional>
#include <sstream>

#include "tools/map/scan_sources.hpp"

namespace parhelion::tools {
namespace {

std::optional<Transform<Cloud, Scanner>> to_pose(const std::vector<double>& v) {
  for (const double value : v) {
    if (!std::isfinite(value)) return std::nullopt;
  }
  if (v.size() == 4) {
    return Transform<Cloud, Scanner>::planar(v[0], v[1], v[3] * std::numbers::pi / 180, v[2]);
  }
  if (v.size() != 16) return std::nullopt;
  Eigen::Isometry3d pose;
  pose.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(v.data());
  const Eigen::Matrix3d R = pose.linear();
  const bool rigid = (R * R.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-3 && R.determinant() > 0 &&
                     (pose.matrix().row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() < 1e-9;
  if (!rigid) return std::nullopt;
  return Transform<Cloud, Scanner>(Eigen::Quaterniond(R), pose.translation());
}

/// Numbers separated by blanks or commas; nullopt: a word is not a number.
std::optional<std::vector<double>> numbers_of(std::string text) {
  for (char& c : text) {
    if (c == ',') c = ' ';
  }
  std::vector<double> numbers;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    std::size_t used = 0;
    try {
      numbers.push_back(std::stod(word, &used));
    } catch (const std::exception&) {
      return std::nullopt;
    }
    if (used != word.size()) return std::nullopt;
  }
  return numbers;
}

Status apply_file(std::ifstream& file, const std::string& path, std::vector<cloud::ScanToRegister>& scans) {
  std::size_t index = 0;
  std::string line;
  for (std::size_t number = 1; std::getline(file, line); ++number) {
    const auto numbers = numbers_of(line.substr(0, line.find('#')));
    if (numbers && numbers->empty()) continue;
    const auto pose = numbers ? to_pose(*numbers) : std::nullopt;
    if (!pose) {
      return Error{path + ":" + std::to_string(number) +
                   ": expected x y z yaw (m, degrees) or the 16 numbers of a rigid 4x4 matrix"};
    }
    if (index < scans.size()) {
      scans[index].guess = *pose;
      scans[index].has_guess = true;
    }
    ++index;
  }
  if (index != scans.size()) {
    return Error{path + ": expected a line for each of the " + std::to_string(scans.size()) +
                 " scans, it has " + std::to_string(index)};
  }
  place_guesses(scans);
  return {};
}

}  // namespace

Status apply_guess(const std::string& text, std::vector<cloud::ScanToRegister>& scans) {
  if (text.empty()) return {};
  if (std::ifstream file(text); file) return apply_file(file, text, scans);
  const auto numbers = numbers_of(text);
  const auto pose = numbers && numbers->size() == 4 ? to_pose(*numbers) : std::nullopt;
  if (!pose) return Error{"--guess " + text + ": expected X,Y,Z,YAW (m, degrees) or a file that exists"};
  if (scans.size() != 2) {
    return Error{"--guess " + text + ": is for the second of two scans, there are " +
                 std::to_string(scans.size()) + "; give a file with a line for each"};
  }
  scans[1].guess = *pose;
  scans[1].has_guess = true;
  return {};
}

}  // namespace parhelion::tools
