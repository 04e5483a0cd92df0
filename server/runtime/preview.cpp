#include "server/runtime/preview.hpp"

#include "protocols/bus/log_file.hpp"
#include "protocols/channel_map.hpp"
#include "protocols/scenario_robots.hpp"
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

bool is_description(std::string_view channel) {
  const auto parts = parse_robot_channel(channel);
  return parts && parts->canonical == channel::kRobot;
}

/// Fills in the descriptions that are missing, from the log's ROBOT messages.
Status add_recorded_robots(const std::string& log, const Scenario& scenario, const Preview& preview,
                           std::vector<std::optional<RobotDescription>>& robots) {
  const std::vector<std::string> names = robots_in_channels(scenario);
  for (std::size_t i = 0; i < robots.size(); ++i) {
    if (robots[i]) continue;
    const std::string channel = robot_channel(channel::kRobot, names.empty() ? "" : names[i]);
    const auto recorded = preview.robot_yamls.find(channel);
    if (recorded == preview.robot_yamls.end()) {
      return Error{log + ": no " + channel + " message; give " +
                   (names.empty() ? "--robot FILE" : "robot '" + names[i] + "' a 'description'") +
                   " (extrinsics, range limits, beam times)"};
    }
    auto description = parse_robot_description(recorded->second, log + " (" + channel + ")");
    if (!description) return description.error();
    robots[i] = std::move(*description);
  }
  return {};
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
    } else if (is_description(message.channel) && !preview.robot_yamls.contains(message.channel)) {
      RobotMessage robot;
      if (const Status read = decode(message.channel, message.payload, robot); !read) return read.error();
      preview.robot_yamls[message.channel] = robot.yaml;
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
  std::vector<ModelObject> objects = recorded ? recorded->objects : std::vector<ModelObject>{};
  tick::RobotModels robot_models = recorded ? recorded->robot_models : tick::RobotModels{};
  auto map = recorded ? recorded->map : nullptr;
  std::vector<std::optional<RobotDescription>> robots(1);
  if (recorded) {  // may have come from files, so ROBOT does not count
    robots.clear();
    for (std::size_t i = 0; i < recorded->robot_count(); ++i) robots.push_back(recorded->robot_at(i));
  }
  if (options.scenario) {
    auto files = load_session_files(*options.scenario, options.robot.value_or(""), options.seed);
    if (!files) return files.error();
    scenario = std::move(files->scenario);
    model = std::move(files->model);
    objects = std::move(files->objects);
    robot_models = std::move(files->robot_models);
    map = std::move(files->map);
    const bool same_robots = files->robots.size() == robots.size();
    for (std::size_t i = 0; i < files->robots.size(); ++i) {
      if (!files->robots[i] && same_robots) files->robots[i] = robots[i];
    }
    robots = std::move(files->robots);
  } else if (options.robot && tick::simulates_trainee(scenario)) {
    return Error{*options.robot +
                 ": the trainee's robot of this session is simulated, and its model in the log " +
                 "describes it; remove --robot"};
  } else if (options.robot) {
    if (robots.size() > 1)
      return Error{*options.robot + ": this session has " + std::to_string(robots.size()) +
                   " robots, and the file describes one; remove --robot"};
    auto given = load_usable_robot(*options.robot);
    if (!given) return given.error();
    robots = {std::move(*given)};
  }
  if (const Status all = add_recorded_robots(options.log, scenario, preview, robots); !all)
    return all.error();
  if (options.seed) scenario.seed = *options.seed;
  std::vector<RobotDescription> descriptions;
  for (auto& each : robots) descriptions.push_back(std::move(*each));
  if (const Status added =
          add_models_of(descriptions, options.scenario.value_or(""), DescribedBy::file, robot_models);
      !added)
    return added.error();
  return tick::configure_robots(scenario, std::move(descriptions), model, std::move(robot_models),
                                std::move(map), std::move(objects));
}

}  // namespace parhelion::runtime
