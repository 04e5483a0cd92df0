#include "tools/map/scan_sources.hpp"

#include <algorithm>
#include <fstream>

#include "tools/import/import.hpp"

namespace parhelion::tools {
namespace {

namespace fs = std::filesystem;

/// Files of points in a folder, by name, without .txt and .csv, which are often something else.
std::vector<fs::path> scan_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string extension = entry.path().extension().string();
    for (const char* known : {".ply", ".pcd", ".3d", ".xyz", ".asc", ".pts"}) {
      if (extension == known) files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

bool is_log(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  char magic[4] = {};
  stream.read(magic, sizeof magic);
  return std::string_view(magic, sizeof magic) == "\xED\xA1\xDA\x01";
}

Status open_file(const fs::path& file, const ScanSourceOptions& options, OpenedScans& opened) {
  auto scan = cloud::read_scan(file, options.read);
  if (!scan) return scan.error();
  for (const std::string& note : scan->notes) opened.notes.push_back(file.string() + ": " + note);
  opened.scans.push_back({file.string(), std::move(scan->cloud),
                          scan->guess.value_or(Transform<Cloud, Scanner>()), scan->guess.has_value()});
  return {};
}

class Opener {
 public:
  explicit Opener(const ScanSourceOptions& options) : options_(options) {}

  Status open(const fs::path& source) {
    std::error_code ignored;
    if (!fs::is_directory(source, ignored)) {
      return is_log(source) ? open_log_scans(source, options_, opened_)
                            : open_file(source, options_, opened_);
    }
    const std::vector<fs::path> files = scan_files(source);
    if (files.empty()) return open_rgbd_scans(source, options_, R_level_world_, opened_);
    for (const fs::path& file : files) {
      if (Status status = open_file(file, options_, opened_); !status) return status;
    }
    return {};
  }
  OpenedScans take() { return std::move(opened_); }

 private:
  const ScanSourceOptions& options_;
  OpenedScans opened_;
  std::optional<Eigen::Matrix3d> R_level_world_;  ///< of the first RGB-D folder, used for later ones
};

}  // namespace

Result<OpenedScans> open_scans(const std::vector<std::string>& sources, const ScanSourceOptions& options,
                               const std::function<void(std::size_t, std::size_t)>& progress) {
  Opener opener(options);
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (Status status = opener.open(sources[i]); !status) return status.error();
    if (progress) progress(i + 1, sources.size());
  }
  OpenedScans opened = opener.take();
  const bool first_has_map = !sources.empty() && !fs::is_directory(sources[0]) && is_log(sources[0]);
  if (first_has_map && !opened.scans.empty() && opened.scans[0].has_guess)
    opened.T_cloud_first = opened.scans[0].guess;
  return opened;
}

void place_guesses(std::vector<cloud::ScanToRegister>& scans) {
  if (scans.empty() || !scans.front().has_guess) return;
  const Transform<Scanner, Cloud> T_first_world = scans.front().guess.inverse();
  for (cloud::ScanToRegister& scan : scans) {
    if (!scan.has_guess) continue;
    scan.guess = (T_first_world * scan.guess).as<Cloud, Scanner>();  // a cloud is in its first scan's frame
  }
}

bool moved_enough(const Eigen::Isometry3d& last, const Eigen::Isometry3d& now,
                  const ScanSourceOptions& options) {
  const Eigen::Isometry3d between = last.inverse() * now;
  return between.translation().norm() >= options.frame_distance ||
         Eigen::AngleAxisd(between.linear()).angle() >= options.frame_angle;
}

}  // namespace parhelion::tools
