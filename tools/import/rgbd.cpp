// RGB-D folders: CAMERA, DEPTH, poses, and a scan cut out of the depth.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "protocols/channels.hpp"
#include "protocols/sha256.hpp"
#include "tools/import/importers.hpp"
#include "tools/import/laser_evidence.hpp"
#include "tools/import/recording_writer.hpp"
#include "tools/import/rgbd_floor.hpp"
#include "tools/import/rgbd_folder.hpp"
#include "tools/import/rgbd_registration.hpp"
#include "tools/import/rgbd_scan.hpp"

namespace parhelion {
namespace {

constexpr double degree = std::numbers::pi / 180;

/// One sigma of the poses (KinectFusion against its own map, motion capture), stated rather than known.
constexpr double sigma_position = 0.01;       // m
constexpr double sigma_angle = 0.3 * degree;  // rad
constexpr std::size_t frames_for_the_floor = 40;

/// The map frame and the robot that carries the camera.
struct Placement {
  Eigen::Isometry3d T_map_world = Eigen::Isometry3d::Identity();
  Transform<Base, DepthOptical> T_base_depth;
  Eigen::Isometry3d T_depth_colour = Eigen::Isometry3d::Identity();
  double camera_height = 0;
  float depth_min = 0, depth_max = 0;  ///< m, seen

  Transform<Map, DepthOptical> map_optical(const Eigen::Isometry3d& T_world_depth) const {
    return Transform<Map, DepthOptical>(T_map_world * T_world_depth);
  }
  Transform<Map, Base> map_base(const Eigen::Isometry3d& T_world_depth) const {
    return map_optical(T_world_depth) * T_base_depth.inverse();
  }
};

struct DepthSurvey {
  SurfacePoints surfaces;
  Registration registration;
  std::uint16_t nearest = 0, farthest = 0;  ///< mm
};

/// The colour image of the same instant, where colour and depth are cameras of their own.
void add_colour(const RgbdFolder& folder, const RgbdFile& frame, const DepthPixels& depth,
                Registration& registration) {
  if (folder.cameras.T_depth_colour.isApprox(Eigen::Isometry3d::Identity())) return;
  const auto same = std::find_if(folder.colour.begin(), folder.colour.end(),
                                 [&](const RgbdFile& file) { return file.stamp == frame.stamp; });
  if (same == folder.colour.end()) return;
  const auto file = read_file(same->path.string());
  if (!file) return;
  const auto grey = read_grey(*file);
  if (grey) registration.add(depth, folder.cameras.depth, *grey);
}

/// Stated calibrations do not always belong to the images: edges decide.
void register_colour(const DepthSurvey& survey, Placement& placement, const RgbdCameras& cameras,
                     std::vector<std::string>& notes) {
  constexpr double clearly_better = 1.05;
  placement.T_depth_colour = cameras.T_depth_colour;
  const Eigen::Isometry3d stated = cameras.T_depth_colour.inverse();
  const double before = survey.registration.score(cameras.colour, stated);
  if (before <= 0) return;
  const Eigen::Isometry3d refined = survey.registration.refine(cameras.colour, stated);
  const double after = survey.registration.score(cameras.colour, refined);
  if (after < clearly_better * before) return;
  placement.T_depth_colour = refined.inverse();
  const Eigen::AngleAxisd turned(Eigen::Matrix3d(refined.linear() * stated.linear().transpose()));
  const Eigen::Quaterniond q(stated.linear());
  char text[320];
  std::snprintf(text, sizeof text,
                "colour turned by %.2f degrees against depth from what the calibration states (quaternion "
                "wxyz %.6f %.6f "
                "%.6f %.6f): depth edges then lie on colour gradients of %.0f on average, before %.0f",
                turned.angle() / degree, q.w(), q.x(), q.y(), q.z(), after, before);
  notes.push_back(text);
}

DepthSurvey survey_depth(const RgbdFolder& folder) {
  DepthSurvey survey;
  const std::size_t step = std::max<std::size_t>(1, folder.depth.size() / frames_for_the_floor);
  for (std::size_t i = 0; i < folder.depth.size(); i += step) {
    const auto pose = pose_at(folder.poses, folder.depth[i].stamp);
    const auto file = read_file(folder.depth[i].path.string());
    if (!pose || !file) continue;
    const auto depth = read_depth_png(*file, folder.depth_units_per_metre);
    if (!depth) continue;
    survey.surfaces.add(*depth, folder.cameras.depth, *pose);
    add_colour(folder, folder.depth[i], *depth, survey.registration);
    for (const std::uint16_t mm : depth->mm) {
      if (mm == 0) continue;
      survey.nearest = survey.nearest == 0 ? mm : std::min(survey.nearest, mm);
      survey.farthest = std::max(survey.farthest, mm);
    }
  }
  return survey;
}

/// Up in the world: as the folder says, else what surfaces near the cameras' own up agree on.
Result<Eigen::Vector3d> find_up(const RgbdFolder& folder, const DepthSurvey& survey,
                                std::vector<std::string>& notes) {
  if (folder.down) return Eigen::Vector3d(-*folder.down);
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const RgbdPose& pose : folder.poses) up -= pose.T_world_depth.linear().col(1);
  const auto refined = survey.surfaces.refine_up(up);
  if (!refined) {
    return Error{
        "which way is up can't be told: too few level surfaces; put gravity-direction.txt (a vector that "
        "points "
        "down) beside the frames"};
  }
  notes.push_back("gravity is not beside the frames: up is what the level surfaces agree on");
  return *refined;
}

/// z up, floor at 0, origin under the first camera, x its heading.
Eigen::Isometry3d map_from_world(const Eigen::Vector3d& up, double floor,
                                 const Eigen::Isometry3d& T_world_first) {
  Eigen::Vector3d ahead = T_world_first.linear().col(2);
  ahead = (ahead - ahead.dot(up) * up).normalized();
  Eigen::Matrix3d R_map_world;
  R_map_world.row(0) = ahead.transpose();
  R_map_world.row(1) = up.cross(ahead).transpose();
  R_map_world.row(2) = up.transpose();
  Eigen::Isometry3d T_map_world = Eigen::Isometry3d::Identity();
  T_map_world.linear() = R_map_world;
  const Eigen::Vector3d origin = R_map_world * T_world_first.translation();
  T_map_world.translation() = Eigen::Vector3d(-origin.x(), -origin.y(), -floor);
  return T_map_world;
}

/// base_link is fixed to the camera: under it on the floor and level at the mean of all poses.
void place_base(const RgbdFolder& folder, Placement& placement, std::vector<std::string>& notes) {
  double height = 0;
  Eigen::Vector4d mean = Eigen::Vector4d::Zero();
  for (const RgbdPose& pose : folder.poses) {
    const auto T_map_optical = placement.map_optical(pose.T_world_depth);
    height += T_map_optical.translation().z();
    const Eigen::Vector3d ahead = T_map_optical.rotation().col(2);
    const Eigen::AngleAxisd level(-std::atan2(ahead.y(), ahead.x()), Eigen::Vector3d::UnitZ());
    const Eigen::Quaterniond q(level * T_map_optical.rotation());
    mean += (mean.dot(q.coeffs()) < 0 ? -1.0 : 1.0) * q.coeffs();
  }
  placement.camera_height = height / static_cast<double>(folder.poses.size());
  Eigen::Quaterniond rotation;
  rotation.coeffs() = mean.normalized();
  placement.T_base_depth = {rotation, {0, 0, placement.camera_height}};
  double tilt = 0, off_floor = 0;
  for (const RgbdPose& pose : folder.poses) {
    const auto T_map_base = placement.map_base(pose.T_world_depth);
    tilt = std::max(tilt, std::acos(std::clamp(T_map_base.rotation()(2, 2), -1.0, 1.0)));
    off_floor = std::max(off_floor, std::abs(T_map_base.translation().z()));
  }
  char text[240];
  std::snprintf(text, sizeof text,
                "the camera is hand-held: base_link is fixed to it, under it on the floor and level at the "
                "mean pose; it "
                "tilts by up to %.1f degrees and leaves the floor by up to %.2f m",
                tilt / degree, off_floor);
  notes.push_back(text);
}

Result<Placement> place(const RgbdFolder& folder, std::vector<std::string>& notes) {
  Placement placement;
  if (folder.poses.empty()) return Error{"no camera pose can be read; without poses there is no map"};
  const DepthSurvey survey = survey_depth(folder);
  placement.depth_min = static_cast<float>(survey.nearest) / 1000;
  placement.depth_max = static_cast<float>(survey.farthest) / 1000;
  const auto up = find_up(folder, survey, notes);
  if (!up) return up.error();
  const auto floor = survey.surfaces.find_floor(*up);
  if (!floor) return Error{"no floor found: no level layer in the depth frames"};
  placement.T_map_world = map_from_world(floor->up, floor->height, folder.poses.front().T_world_depth);
  char text[200];
  std::snprintf(
      text, sizeof text,
      "map: z up, floor (the lowest supported level layer) at 0, %.3f m under the first camera; the floor "
      "leans by %.2f degrees from what was said to be up, and the map follows the floor",
      placement.map_optical(folder.poses.front().T_world_depth).translation().z(), floor->leveled / degree);
  notes.push_back(text);
  place_base(folder, placement, notes);
  register_colour(survey, placement, folder.cameras, notes);
  return placement;
}

/// The poses decide about the map frame: other poses, other id.
std::string map_id(const RgbdFolder& folder, const Placement& placement) {
  std::string text;
  const auto append = [&](const Eigen::Isometry3d& pose) {
    char number[32];
    for (int i = 0; i < 12; ++i) {
      std::snprintf(number, sizeof number, "%.6f ", pose.matrix()(i / 4, i % 4));
      text += number;
    }
  };
  append(placement.T_map_world);
  for (const RgbdPose& pose : folder.poses) append(pose.T_world_depth);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
  Sha256 hash;
  hash.add({bytes, text.size()});
  return "rgbd-" + hash.hex().substr(0, 16);
}

RobotDescription describe(const ImportOptions& options, const RgbdFolder& folder, const Placement& placement,
                          const DepthScanOptions& band, std::vector<std::string>& notes) {
  std::optional<LaserDescription> laser;
  if (!folder.depth.empty()) laser = describe_depth_scan(folder.cameras.depth, band);
  RobotDescription robot = describe_robot(options, laser, notes);
  robot.height = placement.camera_height + 0.1;
  if (!folder.colour.empty()) {
    CameraDescription& camera = robot.camera.emplace();
    camera.intrinsics = folder.cameras.colour;
    camera.T_base_optical =
        Transform<Base, CameraOptical>(placement.T_base_depth.isometry() * placement.T_depth_colour);
    camera.source = folder.cameras.source;
  }
  if (!folder.depth.empty()) {
    DepthCameraDescription& camera = robot.depth.emplace();
    camera.intrinsics = folder.cameras.depth;
    camera.T_base_optical = placement.T_base_depth;
    camera.range_min = placement.depth_min;
    camera.range_max = placement.depth_max;
    camera.source = folder.cameras.source + "; range as seen";
  }
  robot.source += "; " + joined(notes);
  return robot;
}

/// All that happens, in order of stamps; at one stamp the pose goes before the images that it places.
struct Step {
  enum class Kind { pose, colour, depth };
  SensorTime stamp;
  Kind kind;
  std::size_t index;
};

std::vector<Step> steps_of(const RgbdFolder& folder) {
  std::vector<Step> steps;
  for (std::size_t i = 0; i < folder.poses.size(); ++i)
    steps.push_back({folder.poses[i].stamp, Step::Kind::pose, i});
  for (std::size_t i = 0; i < folder.colour.size(); ++i)
    steps.push_back({folder.colour[i].stamp, Step::Kind::colour, i});
  for (std::size_t i = 0; i < folder.depth.size(); ++i)
    steps.push_back({folder.depth[i].stamp, Step::Kind::depth, i});
  std::stable_sort(steps.begin(), steps.end(), [](const Step& a, const Step& b) {
    return a.stamp != b.stamp ? a.stamp < b.stamp : a.kind < b.kind;
  });
  return steps;
}

double total_bytes(const RgbdFolder& folder) {
  double sum = 0;
  for (const auto* files : {&folder.colour, &folder.depth}) {
    for (const RgbdFile& file : *files) {
      std::error_code missing;
      const auto size = std::filesystem::file_size(file.path, missing);
      if (!missing) sum += static_cast<double>(size);
    }
  }
  return sum;
}

class Copy {
 public:
  Copy(RecordingWriter& writer, const RgbdFolder& folder, const Placement& placement,
       const DepthScanOptions& band)
      : writer_(writer),
        folder_(folder),
        placement_(placement),
        band_(band),
        map_id_(map_id(folder, placement)) {}

  Status operator()(const Step& step) {
    switch (step.kind) {
      case Step::Kind::pose:
        return put_pose(folder_.poses[step.index]);
      case Step::Kind::colour:
        return put_colour(folder_.colour[step.index]);
      case Step::Kind::depth:
        return put_depth(folder_.depth[step.index]);
    }
    return {};
  }

 private:
  Status put_pose(const RgbdPose& pose) {
    PoseEstimate estimate;
    estimate.stamp = pose.stamp;
    estimate.T_map_base = placement_.map_base(pose.T_world_depth);
    estimate.covariance.diagonal() << Eigen::Vector3d::Constant(sigma_position * sigma_position),
        Eigen::Vector3d::Constant(sigma_angle * sigma_angle);
    estimate.map_id = map_id_;
    estimate.state = SlamState::tracking;
    if (Status done = writer_.put(channel::pose_cov, estimate, pose.number); !done) return done;
    PoseStamped same;
    same.stamp = pose.stamp;
    same.T_map_base = estimate.T_map_base;
    if (Status done = writer_.put(channel::pose, same, pose.number); !done) return done;
    return writer_.put(channel::reference_pose, same, pose.number);
  }

  Status refuse(const RgbdFile& file, const Error& error) {
    writer_.refuse(file.number, file.path.filename().string() + ": " + error.message);
    return {};
  }

  Status put_colour(const RgbdFile& file) {
    writer_.count_read();
    auto bytes = read_file(file.path.string());
    if (!bytes) return refuse(file, bytes.error());
    const auto image = colour_image(std::move(*bytes), file.stamp);
    if (!image) return refuse(file, image.error());
    if (image->width != folder_.cameras.colour.width || image->height != folder_.cameras.colour.height) {
      return refuse(file, Error{"of another size than the first"});
    }
    return writer_.put(channel::camera, *image, file.number);
  }

  Status put_depth(const RgbdFile& file) {
    writer_.count_read();
    auto bytes = read_file(file.path.string());
    if (!bytes) return refuse(file, bytes.error());
    const auto depth = read_depth_png(*bytes, folder_.depth_units_per_metre);
    if (!depth) return refuse(file, depth.error());
    if (depth->width != folder_.cameras.depth.width || depth->height != folder_.cameras.depth.height) {
      return refuse(file, Error{"of another size than the first"});
    }
    const auto image = depth->as_written
                           ? depth_image(std::move(*bytes), depth->width, depth->height, file.stamp)
                           : depth_image(*depth, file.stamp);
    if (!image) return refuse(file, image.error());
    if (Status done = writer_.put(channel::depth, *image, file.number); !done) return done;
    const auto pose = pose_at(folder_.poses, file.stamp);
    if (!pose) {
      writer_.leave_out("scan of a depth frame without pose");
      return {};
    }
    const Scan scan = cut_scan(*depth, folder_.cameras.depth, placement_.map_base(*pose),
                               placement_.map_optical(*pose), band_, file.stamp);
    return writer_.put(channel::scan, scan, file.number);
  }

  RecordingWriter& writer_;
  const RgbdFolder& folder_;
  const Placement& placement_;
  const DepthScanOptions& band_;
  std::string map_id_;
};

}  // namespace

Result<ImportReport> import_rgbd(const ImportOptions& options, const ImportProgress& progress) {
  const auto folder = read_rgbd_folder(options);
  if (!folder) return folder.error();
  std::vector<std::string> notes = folder->notes;
  const auto placement = place(*folder, notes);
  if (!placement) return Error{options.input.string() + ": " + placement.error().message};
  const DepthScanOptions band{options.scan_low, options.scan_high};
  const RobotDescription robot = describe(options, *folder, *placement, band, notes);
  auto writer = RecordingWriter::create(
      options, options.input.lexically_normal().filename().string() + ", frame ", "images");
  if (!writer) return writer.error();
  for (std::string& note : notes) writer->note(std::move(note));
  for (const Refusal& refusal : folder->refused) writer->refuse_at(refusal);
  const std::vector<Step> steps = steps_of(*folder);
  if (const Status written = writer->describe(robot, steps.front().stamp); !written) return written.error();
  Copy copy(*writer, *folder, *placement, band);
  const double bytes = total_bytes(*folder);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (const Status written = copy(steps[i]); !written) return written.error();
    if (progress) progress(bytes * static_cast<double>(i) / static_cast<double>(steps.size()), bytes);
  }
  return writer->finish();
}

}  // namespace parhelion
