// RGB-D folders: CAMERA, DEPTH, poses, and a scan computed from the depth images.
#include <algorithm>
#include <cstdio>
#include <numbers>

#include "protocols/channels.hpp"
#include "protocols/sha256.hpp"
#include "tools/import/importers.hpp"
#include "tools/import/laser_evidence.hpp"
#include "tools/import/recording_writer.hpp"
#include "tools/import/rgbd_folder.hpp"
#include "tools/import/rgbd_placement.hpp"
#include "tools/import/rgbd_scan.hpp"

namespace parhelion::tools {
namespace {

/// Assumed standard deviations of the poses (KinectFusion against its own map, motion capture).
constexpr double kSigmaPosition = 0.01;                       // m
constexpr double kSigmaAngle = 0.3 * std::numbers::pi / 180;  // rad

/// The parts of a folder that are written to the log.
struct Wanted {
  bool colour = false, depth = false, scan = false, reference = false;
};

/// The whole folder, without what --topics excludes.
Result<Wanted> wanted_of(const ImportOptions& options) {
  struct Source {
    std::string channel;
    std::vector<std::string> names;
    std::string what;
  };
  std::vector<bool> taken;
  for (const Source& source :
       {Source{channel::kCamera, {"color"}, "frames"}, Source{channel::kDepth, {"depth"}, "frames"},
        Source{channel::kScan, {"depth"}, "frames to cut a scan from"},
        Source{channel::kReferencePose, {"pose"}, "poses"}}) {
    const auto chosen = choose_topic(options, source.channel, source.names, source.what);
    if (!chosen) return chosen.error();
    taken.push_back(chosen->has_value());
  }
  return Wanted{taken[0], taken[1], taken[2], taken[3]};
}

/// Derived from the poses, which define the map frame: different poses, different id.
std::string map_id(const RgbdFolder& folder, const RgbdPlacement& placement) {
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

RobotDescription describe(const ImportOptions& options, const Wanted& wanted, const RgbdFolder& folder,
                          const RgbdPlacement& placement, const DepthScanOptions& band,
                          std::vector<std::string>& notes) {
  std::optional<LaserDescription> laser;
  if (wanted.scan && !folder.depth.empty()) laser = describe_depth_scan(folder.cameras.depth, band);
  RobotDescription robot = describe_robot(options, laser, notes);
  robot.height = placement.camera_height + 0.1;
  if (wanted.colour && !folder.colour.empty()) {
    CameraDescription& camera = robot.camera.emplace();
    camera.intrinsics = folder.cameras.colour;
    camera.T_base_optical =
        placement.T_base_depth * Transform<DepthOptical, CameraOptical>(placement.T_depth_colour);
    camera.source = folder.cameras.source;
  }
  if (wanted.depth && !folder.depth.empty()) {
    DepthCameraDescription& camera = robot.depth.emplace();
    camera.intrinsics = folder.cameras.depth;
    camera.T_base_optical = placement.T_base_depth;
    camera.range_min = placement.depth_min;
    camera.range_max = placement.depth_max;
    camera.source = folder.cameras.source + "; observed range";
  }
  robot.source += "; " + joined(notes);
  return robot;
}

/// All events in order of stamps; at equal stamps the pose precedes its images.
struct Step {
  enum class Kind { pose, colour, depth };
  SensorTime stamp;
  Kind kind;
  std::size_t index;
};

std::vector<Step> steps_of(const RgbdFolder& folder, const Wanted& wanted) {
  std::vector<Step> steps;
  for (std::size_t i = 0; i < folder.poses.size(); ++i)
    steps.push_back({folder.poses[i].stamp, Step::Kind::pose, i});
  for (std::size_t i = 0; wanted.colour && i < folder.colour.size(); ++i)
    steps.push_back({folder.colour[i].stamp, Step::Kind::colour, i});
  for (std::size_t i = 0; (wanted.depth || wanted.scan) && i < folder.depth.size(); ++i)
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
  Copy(RecordingWriter& writer, const Wanted& wanted, const RgbdFolder& folder,
       const RgbdPlacement& placement, const DepthScanOptions& band)
      : writer_(writer),
        wanted_(wanted),
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
    estimate.covariance.diagonal() << Eigen::Vector3d::Constant(kSigmaPosition * kSigmaPosition),
        Eigen::Vector3d::Constant(kSigmaAngle * kSigmaAngle);
    estimate.map_id = map_id_;
    estimate.state = SlamState::tracking;
    if (Status done = writer_.put(channel::kPoseCov, estimate, pose.number); !done) return done;
    PoseStamped same;
    same.stamp = pose.stamp;
    same.T_map_base = estimate.T_map_base;
    if (Status done = writer_.put(channel::kPose, same, pose.number); !done) return done;
    return wanted_.reference ? writer_.put(channel::kReferencePose, same, pose.number) : Status{};
  }

  Status refuse(const RgbdFile& file, const Error& error) {
    writer_.refuse(file.number, file.path.filename().string() + ": " + error.message);
    return {};
  }
  Status refuse_damage(const RgbdFile& file, const Error& error) {
    writer_.refuse_damage(file.number, file.path.filename().string() + ": " + error.message);
    return {};
  }

  Status put_colour(const RgbdFile& file) {
    writer_.count_read();
    auto bytes = read_file(file.path.string());
    if (!bytes) return refuse_damage(file, bytes.error());
    if (is_cut_jpeg(*bytes)) return refuse_damage(file, Error{"a JPEG that is cut off"});
    const auto image = colour_image(std::move(*bytes), file.stamp);
    if (!image) return refuse_damage(file, image.error());
    if (image->width != folder_.cameras.colour.width || image->height != folder_.cameras.colour.height) {
      return refuse(file, Error{"its size differs from the first image's"});
    }
    return writer_.put(channel::kCamera, *image, file.number);
  }

  Status put_depth(const RgbdFile& file) {
    writer_.count_read();
    auto bytes = read_file(file.path.string());
    if (!bytes) return refuse_damage(file, bytes.error());
    const auto depth = read_depth_png(*bytes, folder_.depth_units_per_metre);
    if (!depth) return refuse_damage(file, depth.error());
    if (depth->width != folder_.cameras.depth.width || depth->height != folder_.cameras.depth.height) {
      return refuse(file, Error{"its size differs from the first image's"});
    }
    if (wanted_.depth) {
      const auto image = depth->as_written
                             ? depth_image(std::move(*bytes), depth->width, depth->height, file.stamp)
                             : depth_image(*depth, file.stamp);
      if (!image) return refuse(file, image.error());
      if (Status done = writer_.put(channel::kDepth, *image, file.number); !done) return done;
    }
    if (!wanted_.scan) return {};
    const auto pose = pose_at(folder_.poses, file.stamp);
    if (!pose) {
      writer_.leave_out("scan of a depth frame without pose");
      return {};
    }
    const Scan scan = scan_from_depth(*depth, folder_.cameras.depth, placement_.map_base(*pose),
                                      placement_.map_optical(*pose), band_, file.stamp);
    return writer_.put(channel::kScan, scan, file.number);
  }

  RecordingWriter& writer_;
  const Wanted wanted_;
  const RgbdFolder& folder_;
  const RgbdPlacement& placement_;
  const DepthScanOptions& band_;
  std::string map_id_;
};

}  // namespace

Result<ImportReport> import_rgbd(const ImportOptions& options, const ImportProgress& progress) {
  const auto wanted = wanted_of(options);
  if (!wanted) return wanted.error();
  const auto folder = read_rgbd_folder(options);
  if (!folder) return folder.error();
  std::vector<std::string> notes = folder->notes;
  const auto placement = place_rgbd(*folder, notes);
  if (!placement) return Error{options.input.string() + ": " + placement.error().message};
  const DepthScanOptions band{options.scan_low, options.scan_high};
  const RobotDescription robot = describe(options, *wanted, *folder, *placement, band, notes);
  auto writer = RecordingWriter::create(
      options, options.input.lexically_normal().filename().string() + ", frame ", "images");
  if (!writer) return writer.error();
  for (std::string& note : notes) writer->note(std::move(note));
  for (const Refusal& refusal : folder->refused) writer->refuse_at(refusal);
  for (const Refusal& refusal : folder->damaged) writer->refuse_damage_at(refusal);
  const std::vector<Step> steps = steps_of(*folder, *wanted);
  if (const Status written = writer->describe(robot, steps.front().stamp); !written) return written.error();
  Copy copy(*writer, *wanted, *folder, *placement, band);
  const double bytes = total_bytes(*folder);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (const Status written = copy(steps[i]); !written) return written.error();
    if (progress) progress(bytes * static_cast<double>(i) / static_cast<double>(steps.size()), bytes);
  }
  return writer->finish();
}

}  // namespace parhelion::tools
