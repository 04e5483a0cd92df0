// `parhelion map register`: registers 3D scans into one cloud.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "fusion/cloud/registration.hpp"
#include "fusion/cloud/write_cloud.hpp"
#include "tools/command_line.hpp"
#include "tools/map/cloud_file_names.hpp"
#include "tools/map/map_commands.hpp"
#include "tools/map/scan_guess.hpp"
#include "tools/map/scan_sources.hpp"
#include "tools/progress.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

constexpr const char* kDescription = "Register 3D scans (ICP, loops closed) into one cloud";
constexpr const char* kFooter =
    "Examples:\n  parhelion map register scan000.3d scan001.3d scan002.3d -o corridor.ply --summary s.json\n"
    "  parhelion map register room1.pcd room2.pcd --guess 1.79,0.72,0,39.7 -o room.ply\n\n"
    "SCANS are files (.ply .pcd .las .bt .3d .xyz .txt .asc .pts .csv), folders of them, folders of depth "
    "images with "
    "poses\n(7-Scenes, TUM), or LCM logs with poses and DEPTH images or scan lines of a laser that is not "
    "level.\nThe cloud is in the first scan's frame, that of a log in the map of its poses; metres, z up. A "
    "scan that\ncannot be registered is never in it: exit 1 and no cloud, or with --keep-going the cloud of "
    "the others.";

struct Arguments {
  std::vector<std::string> scans;
  std::string output, summary, guess;
  ScanSourceOptions source;
  cloud::RegistrationOptions registration;
  bool overwrite = false, keep_going = false, trust_poses = false;
};

nlohmann::json to_json(const std::string& name, const cloud::RegisteredScan& scan) {
  nlohmann::json entry = {
      {"name", name},      {"converged", scan.converged}, {"why", scan.why},      {"overlap", scan.overlap},
      {"rms_m", scan.rms}, {"seconds", scan.seconds},     {"T_map_scan", nullptr}};
  if (!scan.converged) return entry;
  entry["T_map_scan"] = nlohmann::json::array();
  const Eigen::Matrix4d T = scan.T_cloud_scan.isometry().matrix();
  for (int row = 0; row < 4; ++row)
    entry["T_map_scan"].push_back({T(row, 0), T(row, 1), T(row, 2), T(row, 3)});
  return entry;
}

Status write_summary(const Arguments& arguments, const std::vector<std::string>& names,
                     const cloud::RegisteredSequence& sequence, double seconds) {
  if (arguments.summary.empty()) return {};
  nlohmann::json summary = {{"points", sequence.cloud.size()}, {"seconds", seconds}};
  summary["scans"] = nlohmann::json::array();
  for (std::size_t i = 0; i < names.size(); ++i)
    summary["scans"].push_back(to_json(names[i], sequence.scans[i]));
  return write_text(arguments.summary, summary.dump(2) + "\n", arguments.overwrite);
}

Status refuse_overwriting(const Arguments& arguments) {
  for (const std::string& path : {arguments.output, arguments.summary}) {
    std::error_code ignored;
    if (path.empty() || path == "-" || arguments.overwrite || !std::filesystem::exists(path, ignored))
      continue;
    return Error{path + ": exists already; choose another name or give --force"};
  }
  const std::string extension = std::filesystem::path(arguments.output).extension().string();
  if (extension == ".ply" || extension == ".pcd") return {};
  return Error{arguments.output + ": a cloud is written as .ply or .pcd"};
}

Result<OpenedScans> open(const Arguments& arguments) {
  Progress progress("open", "sources");
  auto opened = open_scans(arguments.scans, arguments.source, [&](std::size_t done, std::size_t total) {
    progress.update(static_cast<double>(done), static_cast<double>(total));
  });
  progress.finish();
  if (!opened) return opened;
  place_guesses(opened->scans);
  if (Status status = apply_guess(arguments.guess, opened->scans); !status) return status.error();
  for (const std::string& note : opened->notes)
    std::fprintf(stderr, "parhelion map register: %s\n", note.c_str());
  return opened;
}

/// Merges the scans at their stated poses, for sources that were tracked well by other means.
Result<cloud::RegisteredSequence> fuse(const std::vector<cloud::ScanToRegister>& scans) {
  if (scans.empty() || scans.size() > 0xFFFF) return Error{"expected 1 to 65535 scans"};
  cloud::RegisteredSequence sequence;
  cloud::PointCloud<Cloud>& cloud = sequence.cloud;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (!scans[i].has_guess) return Error{scans[i].name + ": has no pose"};
    const cloud::PointCloud<Cloud> placed = cloud::transformed(scans[i].guess, scans[i].cloud);
    cloud.points.insert(cloud.points.end(), placed.points.begin(), placed.points.end());
    cloud.scans.resize(cloud.size(), static_cast<std::uint16_t>(i));
    cloud.viewpoints.push_back(scans[i].guess.translation());
    sequence.scans.push_back({scans[i].guess, true, "placed by its pose", 0, 0, 0});
  }
  return sequence;
}

/// From the first scan's frame to the cloud's frame.
void move(const Transform<Cloud, Scanner>& T_cloud_first, cloud::RegisteredSequence& sequence) {
  // The sequence's cloud is in the frame of its first scan.
  const auto T_cloud_before = T_cloud_first.as<Cloud, Cloud>();
  sequence.cloud = cloud::transformed(T_cloud_before, sequence.cloud);
  for (cloud::RegisteredScan& scan : sequence.scans) scan.T_cloud_scan = T_cloud_before * scan.T_cloud_scan;
}

/// Prints the result of each scan; returns the number of failures.
std::size_t report(const std::vector<std::string>& names, const cloud::RegisteredSequence& sequence) {
  std::size_t failed = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const cloud::RegisteredScan& scan = sequence.scans[i];
    if (scan.converged) continue;
    ++failed;
    std::fprintf(stderr, "parhelion map register: %s: not registered: %s\n", names[i].c_str(),
                 scan.why.c_str());
  }
  return failed;
}

Status run(const Arguments& arguments) {
  const auto start = std::chrono::steady_clock::now();
  if (Status status = refuse_overwriting(arguments); !status) return status;
  const auto opened = open(arguments);
  if (!opened) return opened.error();
  Progress progress("register", "scans");
  auto sequence = arguments.trust_poses
                      ? fuse(opened->scans)
                      : cloud::register_sequence(
                            opened->scans, arguments.registration, [&](std::size_t done, std::size_t total) {
                              progress.update(static_cast<double>(done), static_cast<double>(total));
                            });
  progress.finish();
  if (!sequence) return sequence.error();
  move(opened->T_cloud_first, *sequence);
  std::vector<std::string> names;
  for (const cloud::ScanToRegister& scan : opened->scans) names.push_back(scan.name);
  const std::size_t failed = report(names, *sequence);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (Status status = write_summary(arguments, names, *sequence, seconds); !status) return status;
  if (failed > 0 && !arguments.keep_going) {
    return Error{std::to_string(failed) + " of " + std::to_string(names.size()) +
                 " scans could not be registered, no cloud is written; better guesses (--guess), or "
                 "--keep-going for the others"};
  }
  const bool pcd = std::filesystem::path(arguments.output).extension() == ".pcd";
  const Status written = pcd ? cloud::write_pcd(arguments.output, sequence->cloud)
                             : cloud::write_ply(arguments.output, sequence->cloud);
  if (!written) return written;
  std::fprintf(stderr, "%s: %zu points of %zu scans in %.1f s\n", arguments.output.c_str(),
               sequence->cloud.size(), names.size() - failed, seconds);
  return {};
}

void add_options(CLI::App& command, Arguments& arguments) {
  static const std::map<std::string, cloud::IcpMethod> methods = {
      {"point-to-point", cloud::IcpMethod::point_to_point},
      {"point-to-plane", cloud::IcpMethod::point_to_plane},
      {"generalised", cloud::IcpMethod::generalised},
      {"paper", cloud::IcpMethod::paper}};
  command.add_option("SCANS", arguments.scans, "Scans, folders of scans, LCM logs")->required();
  command.add_option("-o,--output", arguments.output, "Cloud to write (.ply or .pcd)")->required();
  command.add_option("--summary", arguments.summary, "Result of each scan (JSON; - is standard output)");
  command.add_option(
      "--guess", arguments.guess,
      "Pose of the second scan in the first: X,Y,Z,YAW (m, degrees); or a FILE with one line per scan: "
      "x y z yaw, or 16 numbers of a matrix by rows");
  command
      .add_option("--unit", arguments.source.read.unit,
                  "Unit of the files: m, cm, mm, ft, in (default: by format)")
      ->transform(one_of(kLengthUnits))
      ->type_name("TEXT");
  command.add_option("--axes", arguments.source.read.axes, "Axes of the files (default: by format)")
      ->transform(one_of(kFileAxes))
      ->type_name("TEXT");
  command.add_option("--robot", arguments.source.robot, "Robot description instead of a log's own");
  command.add_option(
      "--tilt-joint", arguments.source.tilt_joint,
      "Joint that turns the laser of a log's SCAN about its y axis (LINES: see the robot description)");
  command.add_option("--pixel-step", arguments.source.pixel_step, "Every n-th pixel of depth images")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  command
      .add_option(
          "--method", arguments.registration.method,
          "Kind of ICP: point-to-plane (default), point-to-point or generalised, of surfels from coarse "
          "to fine; or paper: point to point over all points in a grid of 28 x 28 x 28 cubes, slow")
      ->transform(one_of(methods))
      ->type_name("TEXT");
  command
      .add_option("--iterations", arguments.registration.max_iterations,
                  "Maximum ICP iterations per scan; without convergence it counts as failed")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  command.add_option("--threads", arguments.registration.threads, "Threads; 0: all")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command.add_flag("--trust-poses", arguments.trust_poses, "Merge the scans at their poses, without ICP");
  command.add_flag("--keep-going", arguments.keep_going,
                   "Write the cloud even if a scan could not be registered");
  command.add_flag("--force", arguments.overwrite, "Overwrite CLOUD and summary");
}

}  // namespace

void add_map_register(CLI::App& map, Exit& exit) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = map.add_subcommand("register", kDescription);
  command->footer(kFooter);
  add_options(*command, *arguments);
  run_where_given(*command, arguments, exit, run);
}

}  // namespace parhelion::tools
