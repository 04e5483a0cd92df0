#include "server/runtime/preview.hpp"

#include "protocols/bus/log_file.hpp"
#include "server/runtime/session_files.hpp"

namespace parhelion::runtime {
namespace {

void note_decision(const Message& message, Preview& preview) {
  LoopDecision decision;
  if (!decode(message.channel, message.payload, decision)) return;
  const auto sequence = static_cast<std::uint64_t>(decision.count);
  if (decision.kind == LoopDecision::Kind::guard_fired) preview.guarded_scans.insert(sequence);
  if (decision.kind == LoopDecision::Kind::frame_dropped) preview.dropped_frames.insert(sequence);
}

}  // namespace

Result<Preview> look_ahead(const std::string& path) {
  auto reader = LogReader::open(path);
  if (!reader) return reader.error();
  Preview preview;
  while (true) {
    auto next = reader->next();
    if (!next) {  // reported by the replay pass
      if (preview.damage.empty()) preview.damage = next.error().message;
      continue;
    }
    if (!*next) break;
    const Message& message = **next;
    ++preview.events;
    if (message.channel == channel::kMrSession && !preview.session) {
      SessionHeader header;
      if (const Status read = decode(message.channel, message.payload, header); !read) return read.error();
      preview.session = header;
    } else if (message.channel == channel::kRobot && !preview.robot_yaml) {
      RobotMessage robot;
      if (const Status read = decode(message.channel, message.payload, robot); !read) return read.error();
      preview.robot_yaml = robot.yaml;
    } else if (message.channel == channel::kLoop) {
      note_decision(message, preview);
    }
  }
  if (preview.events == 0) {
    return Error{path + ": no event in it; expected an LCM log with SCAN and ROBOT" +
                 (preview.damage.empty() ? "" : " (" + preview.damage + ")")};
  }
  return preview;
}

Result<tick::Configuration> choose_configuration(const ReplayOptions& options, const Preview& preview) {
  std::optional<tick::Configuration> recorded;
  if (preview.session) {
    auto own = tick::configuration_from(*preview.session, options.log);
    if (!own) return own.error();
    recorded = std::move(*own);
  }
  if (!options.scenario && !recorded) {
    return Error{options.log + ": not a session log, so it does not define the agents; give --scenario FILE"};
  }
  Scenario scenario = recorded ? recorded->scenario : Scenario{};
  SemanticModel model = recorded ? recorded->model : SemanticModel{};
  tick::RobotModels robot_models = recorded ? recorded->robot_models : tick::RobotModels{};
  auto map = recorded ? recorded->map : nullptr;
  std::optional<RobotDescription> robot;
  if (recorded) robot = recorded->robot;  // may have come from a file, so ROBOT does not count
  if (options.scenario) {
    auto files = load_session_files(*options.scenario, options.robot.value_or(""), options.seed);
    if (!files) return files.error();
    scenario = std::move(files->scenario);
    model = std::move(files->model);
    robot_models = std::move(files->robot_models);
    map = std::move(files->map);
    if (files->robot) robot = std::move(files->robot);
  } else if (options.robot && tick::simulates_trainee(scenario)) {
    return Error{*options.robot +
                 ": the trainee's robot of this session is simulated, and its model in the log " +
                 "describes it; leave --robot out"};
  } else if (options.robot) {
    auto given = load_usable_robot(*options.robot);
    if (!given) return given.error();
    robot = std::move(*given);
  }
  if (!robot && preview.robot_yaml) {
    auto description = parse_robot_description(*preview.robot_yaml, options.log + " (ROBOT)");
    if (!description) return description.error();
    robot = std::move(*description);
  }
  if (!robot) {
    return Error{options.log +
                 ": no ROBOT message; give --robot FILE (extrinsics, range limits, beam times)"};
  }
  if (options.seed) scenario.seed = *options.seed;
  return tick::configure(scenario, *robot, model, std::move(robot_models), std::move(map));
}

}  // namespace parhelion::runtime
