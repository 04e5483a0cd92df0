#include "tools/demo/demo.hpp"

#include <filesystem>

#include "fusion/semantic/grid/extrude.hpp"
#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/runtime/preview.hpp"
#include "server/runtime/replay.hpp"
#include "tools/demo/driven_training.hpp"
#include "tools/demo/live_demo.hpp"
#include "tools/demo/pictures.hpp"
#include "tools/demo/place_agents.hpp"
#include "tools/demo/stand_in_camera.hpp"
#include "tools/demo/witness.hpp"
#include "tools/import/import.hpp"
#include "tools/slam/slam_log.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

constexpr const char* kSena =
    "/usr/share/mrpt/datasets/2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog";
constexpr double kCameraRate = 10;  // Hz

/// File names in the demo's folder.
struct Files {
  explicit Files(const std::filesystem::path& folder)
      : recording(folder / "recording.lcm"),
        localized(folder / "localized.lcm"),
        with_camera(folder / "with-camera.lcm"),
        map(folder / "map"),
        model(folder / "model.yaml"),
        scenario(folder / "scenario.yaml"),
        map_picture(folder / "map.png"),
        camera_picture(folder / "camera.jpg") {}
  std::string recording, localized, with_camera, map, model, scenario, map_picture, camera_picture;
};

/// x, y, yaw of each pose on POSE_COV.
Result<std::vector<Eigen::Vector3d>> driven_path(const std::string& log) {
  auto reader = LogReader::open(log);
  if (!reader) return reader.error();
  std::vector<Eigen::Vector3d> path;
  while (true) {
    const auto next = reader->next();
    if (!next) return next.error();
    if (!*next) return path;
    PoseEstimate pose;
    if ((*next)->channel != channel::kPoseCov || !decode((*next)->channel, (*next)->payload, pose)) continue;
    const Eigen::Vector3d p = pose.T_map_base.translation();
    if (pose.state == SlamState::tracking) path.emplace_back(p.x(), p.y(), pose.T_map_base.yaw());
  }
}

pose::SlamEngine mapping_engine(pose::SlamEngine engine) {
  return engine == pose::SlamEngine::mrpt_localization ? pose::SlamEngine::parhelion : engine;
}

pose::SlamEngine localizing_engine(pose::SlamEngine engine) {
  return engine == pose::SlamEngine::parhelion ? engine : pose::SlamEngine::mrpt_localization;
}

class Demo {
 public:
  explicit Demo(const DemoOptions& options) : options_(options), files_(options.folder) {}
  Result<DemoResult> run();

 private:
  Status import();
  Status build_map();
  Status localize();
  Status make_scenario();
  Status add_camera();
  Status serve_live();
  Status replay_with_agents();
  Status look_on(runtime::ReplayOptions& options);
  Status draw();
  void notify(const std::string& line) const {
    if (options_.notify) options_.notify(line);
  }
  std::function<void(double, double)> progress(const std::string& task) const {
    return [this, task](double done, double total) {
      if (options_.progress) options_.progress(task, done, total);
    };
  }

  const DemoOptions& options_;
  const Files files_;
  pose::GridMap map_;
  SemanticModel model_;
  Witness witness_;
  std::string replayed_ = files_.localized;
  std::string camera_note_;
  DemoResult result_;
};

Status Demo::import() {
  ImportOptions options;
  options.input = options_.recording.empty() ? kSena : options_.recording;
  options.output = files_.recording;
  options.overwrite = options_.overwrite;
  options.robot_name = "real_robot";
  if (!std::filesystem::exists(options.input)) {
    return Error{options.input.string() +
                 ": missing; it is in Debian's package mrpt-common (apt-get install mrpt-common)"};
  }
  const auto report = import_recording(options, progress("import"));
  if (!report) return report.error();
  notify("imported   " + summary_line(*report));
  return {};
}

Status Demo::build_map() {
  SlamLogOptions options;
  options.input = files_.recording;
  options.save_map = files_.map;
  options.slam.engine = mapping_engine(options_.engine);
  options.overwrite = options_.overwrite;
  const auto mapped = map_log(options, progress("slam"));
  if (!mapped) return mapped.error();
  notify("mapped     " + mapped->summary);
  map_ = mapped->map;
  auto model = semantic::extrude(map_, {});
  if (!model) return model.error();
  model_ = std::move(*model);
  notify("extruded   " + std::to_string(model_.entities.size()) + " elements of the building from the map");
  return write_text(files_.model, to_yaml(model_), options_.overwrite);
}

Status Demo::localize() {
  SlamLogOptions options;
  options.input = files_.recording;
  options.output = files_.localized;
  options.map = files_.map + ".simplemap";
  options.slam.engine = localizing_engine(options_.engine);
  options.slam.start = Eigen::Vector3d::Zero();  // a map's origin is where its recording began
  options.overwrite = options_.overwrite;
  const auto localized = localize_log(options, progress("localize"));
  if (!localized) return localized.error();
  notify("localized  " + localized->summary);
  auto path = driven_path(files_.localized);
  if (!path) return path.error();
  map_.path = std::move(*path);
  return {};
}

Status Demo::make_scenario() {
  Scenario scenario;
  scenario.name = "demo";
  scenario.model = files_.model;
  scenario.map = std::filesystem::path(files_.map).filename().string() + ".simplemap";  // beside the scenario
  const auto agents = place_agents(map_, map_.path);
  if (!agents) return agents.error();
  scenario.agents = *agents;
  // Without a page, nobody can drive.
  if (!options_.http.empty()) {
    if (const Status added = add_driven_training(map_, scenario.agents.front().name, scenario); !added)
      notify("not graded  " + added.error().message);
  }
  std::string names;
  for (const AgentDefinition& agent : scenario.agents) {
    names += (names.empty() ? "" : ", ") + agent.name + " (" + to_string(agent.behaviour.kind) + ")";
  }
  notify("scenario   " + names);
  scenario.model = std::filesystem::path(files_.model).filename().string();  // beside the scenario
  return write_text(files_.scenario, to_yaml(scenario), options_.overwrite);
}

Status Demo::add_camera() {
  const auto camera = render::VirtualCamera::create(model_);
  if (!camera) {  // no EGL: show the scans without camera
    camera_note_ = "none: the recording has none, and no stand-in can be rendered: " + camera.error().message;
    notify("camera     " + camera_note_);
    return {};
  }
  camera_note_ = "stand-in: rendered from the extruded model";
  replayed_ = files_.with_camera;
  const auto images = add_stand_in_camera(files_.localized, files_.with_camera, options_.overwrite, **camera,
                                          kCameraRate, progress("camera"));
  if (!images) return images.error();
  notify("camera     the recording has none: " + std::to_string(*images) +
         " stand-in images rendered from the model, marked as such");
  return {};
}

/// Runs the live server with a base station until it is ended, then reads the recording.
Status Demo::serve_live() {
  const auto preview = runtime::look_ahead(replayed_);
  if (!preview) return preview.error();
  runtime::ReplayOptions files;
  files.log = replayed_;
  files.scenario = files_.scenario;
  const auto configuration = runtime::choose_configuration(files, *preview);
  if (!configuration) return configuration.error();
  LiveDemoOptions live;
  live.log = replayed_;
  live.session = result_.session;
  live.overwrite = options_.overwrite;
  live.http = options_.http;
  live.foxglove = options_.foxglove;
  live.folder = options_.folder;
  live.bus = options_.bus;
  live.notify = options_.notify;
  live.stop = options_.stop;
  auto report = serve_demo(*configuration, live);
  if (!report) return report.error();
  notify("ended      reading " + result_.session + " for the pictures");
  runtime::ReplayOptions recorded;
  recorded.log = result_.session;
  if (const Status looked = look_on(recorded); !looked) return looked;
  result_.report = std::move(*report);
  result_.report.notes["camera"] = result_.camera = camera_note_;
  return {};
}

Status Demo::replay_with_agents() {
  if (!options_.http.empty()) return serve_live();
  runtime::ReplayOptions options;
  options.log = replayed_;
  options.scenario = files_.scenario;
  options.session = result_.session;
  options.overwrite = options_.overwrite;
  options.rate = options_.fast ? 0 : 1;
  options.bus = options_.bus;
  options.stop = options_.stop;
  options.notes = {{"camera", camera_note_}};
  return look_on(options);
}

Status Demo::look_on(runtime::ReplayOptions& options) {
  const auto show = progress("replay");
  options.progress = [&](const runtime::ReplayProgress& at) {
    show(static_cast<double>(at.bytes_done) / 1e6, static_cast<double>(at.bytes_total) / 1e6);
  };
  options.watch = [this](const tick::Configuration& configuration, const Message& input,
                         const tick::RobotState& robot) { witness_.see(configuration, input, robot); };
  options.watch_camera = [this](const Image& answer) { witness_.see_answer(answer); };
  auto report = runtime::replay(options);
  if (!report) return report.error();
  result_.report = std::move(*report);
  result_.camera = camera_note_;
  return {};
}

Status Demo::draw() {
  result_.map_picture = files_.map_picture;
  if (const Status drawn = draw_map_picture(files_.map_picture, map_, model_, witness_); !drawn) return drawn;
  if (!witness_.best_image()) return {};
  const std::vector<std::uint8_t>& jpeg = witness_.best_image()->bytes;
  result_.camera_picture = files_.camera_picture;
  return write_text(files_.camera_picture, std::string(jpeg.begin(), jpeg.end()), true);
}

Result<DemoResult> Demo::run() {
  std::error_code failed;
  std::filesystem::create_directories(options_.folder, failed);
  if (failed) return Error{options_.folder + ": cannot be created: " + failed.message()};
  result_.session = options_.session.empty()
                        ? (std::filesystem::path(options_.folder) / "session.lcm").string()
                        : options_.session;
  using Step = Status (Demo::*)();
  bool live = false;  // a live session is ended by stopping it; its pictures are still drawn
  for (const Step step : {&Demo::import, &Demo::build_map, &Demo::localize, &Demo::make_scenario,
                          &Demo::add_camera, &Demo::replay_with_agents, &Demo::draw}) {
    if (const Status done = (this->*step)(); !done) return done.error();
    live = live || (step == &Demo::replay_with_agents && !options_.http.empty());
    if (!live && options_.stop && options_.stop()) return Error{"stopped"};
  }
  return std::move(result_);
}

}  // namespace

Result<DemoResult> run_demo(const DemoOptions& options) { return Demo(options).run(); }

}  // namespace parhelion::tools
