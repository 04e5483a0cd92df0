#include "server/runtime/session_files.hpp"

#include <algorithm>
#include <filesystem>
#include <functional>

#include "protocols/nearest_name.hpp"
#include "protocols/yaml/document.hpp"
#include "server/runtime/check_hazards.hpp"
#include "server/runtime/fixed_texture.hpp"
#include "server/runtime/session_state.hpp"
#include "server/simulation/bodies/movable_objects.hpp"
#include "server/tick/check_reach.hpp"
#include "server/tick/state.hpp"

namespace parhelion::runtime {
namespace {

/// "lab.yaml:2: ": line of `key` in a file that was read before, or its first line.
std::string place_of(const std::string& path, const std::string& key) {
  const auto text = yaml::read_text(path);
  const auto document = text ? yaml::read_document(*text, path) : Result<yaml::Node>(text.error());
  const yaml::Node* node = document ? document->find(key) : nullptr;
  return path + ":" + std::to_string(node == nullptr ? 1 : node->line) + ": ";
}

/// The same for the door, agent, script, task or penalty named in `message`, from make_state.
std::string place_of_item(const std::string& path, const Scenario& scenario, const std::string& message) {
  if (message.starts_with("scenario trainee")) return place_of(path, "trainee");
  const auto text = yaml::read_text(path);
  const auto document = text ? yaml::read_document(*text, path) : Result<yaml::Node>(text.error());
  const auto line_in = [&](const yaml::Node* items, const char* what, const auto& named) {
    for (std::size_t i = 0; items != nullptr && i < items->items.size() && i < named.size(); ++i) {
      if (message.starts_with(std::string(what) + " '" + named[i].name + "'")) return items->items[i].line;
    }
    return 0;
  };
  if (!document) return path + ":1: ";
  int line = std::max({1, line_in(document->find("agents"), "scenario agent", scenario.agents),
                       line_in(document->find("doors"), "scenario door", scenario.doors),
                       line_in(document->find("scripts"), "script", scenario.scripts)});
  if (const yaml::Node* training = document->find("training"); training != nullptr && scenario.training) {
    line = std::max({line, line_in(training->find("tasks"), "task", scenario.training->tasks),
                     line_in(training->find("penalties"), "penalty", scenario.training->penalties)});
  }
  return path + ":" + std::to_string(line) + ": ";
}

std::string folder_of(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

/// ", did you mean 'site.yaml'?" where the folder has a file of a similar name, else "."
std::string like_it(const std::string& path) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder_of(path), ignored)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  const std::string similar = suggestion(std::filesystem::path(path).filename().string(), names);
  return similar.empty() ? "." : similar;
}

/// "lab.yaml:7: ": line of an agent in a file that was read before.
std::string place_of_agent(const std::string& path, std::size_t index) {
  const auto text = yaml::read_text(path);
  const auto document = text ? yaml::read_document(*text, path) : Result<yaml::Node>(text.error());
  const yaml::Node* agents = document ? document->find("agents") : nullptr;
  const bool found = agents != nullptr && index < agents->items.size();
  return path + ":" + std::to_string(found ? agents->items[index].line : 1) + ": ";
}

/// `model`: a name, or a file path, which is replaced by the model's name. `place`: asked for errors only, as
/// it reads a file.
Status add_robot_model(const std::function<std::string()>& place, std::string& model,
                       tick::RobotModels& models) {
  const auto called = [&](const std::string& name) {
    return std::find_if(models.begin(), models.end(), [&](const auto& each) { return each->name == name; });
  };
  if (model.empty() || called(model) != models.end()) return {};
  auto read = simulation::load_robot_model(model);
  if (!read) return Error{place() + read.error().message};
  const auto same = called(read->name);
  if (same != models.end() && ((*same)->urdf != read->urdf || (*same)->yaml != read->yaml))
    return Error{place() + "robot model " + model + " is called '" + read->name +
                 "' like another one; rename it in its URDF"};
  model = read->name;
  if (same == models.end())
    models.push_back(std::make_shared<const simulation::RobotModel>(std::move(*read)));
  return {};
}

Status load_robot_models(const std::string& path, SessionFiles& files) {
  for (std::string name : simulation::shipped_robot_models()) {
    if (Status added = add_robot_model([] { return ""; }, name, files.robot_models); !added) return added;
  }
  Scenario& scenario = files.scenario;
  if (scenario.trainee) {
    Status added = add_robot_model([&] { return place_of(path, "trainee"); }, scenario.trainee->model,
                                   files.robot_models);
    if (!added) return added;
  }
  for (std::size_t i = 0; i < scenario.agents.size(); ++i) {
    Status added = add_robot_model([&] { return place_of_agent(path, i); }, scenario.agents[i].model,
                                   files.robot_models);
    if (!added) return added;
  }
  return {};
}

/// With a simulated robot the model's movable objects are bodies; around a real one they are real.
Status load_objects(SessionFiles& files) {
  if (!tick::simulates_trainee(files.scenario)) return {};
  const auto remarks = load_remarks(files.scenario.model);
  if (!remarks) return remarks.error();
  auto objects = simulation::take_movable(files.model, remarks->objects);
  if (!objects) return Error{files.scenario.model + ": " + objects.error().message};
  files.objects = std::move(*objects);
  return {};
}

/// Only the scans of a real robot are matched.
Status load_map(const std::string& path, SessionFiles& files) {
  const Scenario& scenario = files.scenario;
  if (scenario.map.empty() || !scenario.scan_matching || tick::simulates_trainee(scenario)) return {};
  if (std::filesystem::path(scenario.map).extension() == ".yaml") {
    const Status readable = yaml::check_file(scenario.map);
    if (!readable) return Error{place_of(path, "map") + readable.error().message};
  }
  const auto packed = pose::pack_matching_map(scenario.map);
  if (!packed) return Error{place_of(path, "map") + packed.error().message};
  auto map = pose::unpack_matching_map(*packed, scenario.map);
  if (!map) return Error{place_of(path, "map") + map.error().message};
  files.map = std::make_shared<const pose::MatchingMap>(std::move(*map));
  return {};
}

/// The descriptions of real robots. `given`: a path that replaces the scenario's; empty: none.
Status load_robots(const std::string& path, const std::string& given, SessionFiles& files) {
  const Scenario& scenario = files.scenario;
  std::vector<std::string> paths{given.empty() ? scenario.robot : given};
  if (!scenario.robots.empty()) {
    paths.clear();
    for (const ScenarioRobot& each : scenario.robots) paths.push_back(each.description);
    if (!given.empty() && paths.size() > 1) {
      return Error{place_of(path, "robots") + "this scenario has " + std::to_string(paths.size()) +
                   " robots, and --robot " + given +
                   " describes only one: remove it, and give each robot its 'description'"};
    }
    if (!given.empty()) paths = {given};
  }
  for (std::size_t i = 0; i < paths.size(); ++i) {
    std::optional<RobotDescription>& description = files.robots.emplace_back();
    if (paths[i].empty()) continue;
    auto usable = load_usable_robot(paths[i]);
    if (!usable) return usable.error();
    description = std::move(*usable);
    if (!scenario.robots.empty()) description->name = scenario.robots[i].name;
    const Status added =
        add_robot_model([&] { return place_of(paths[i], "model"); }, description->model, files.robot_models);
    if (!added) return added;
  }
  return {};
}

}  // namespace

Status add_models_of(std::vector<RobotDescription>& robots, const std::string& scenario, DescribedBy by,
                     tick::RobotModels& models) {
  for (RobotDescription& robot : robots) {
    const std::filesystem::path path(robot.model);
    const bool leaves = path.is_absolute() || std::find(path.begin(), path.end(), "..") != path.end();
    if (by == DescribedBy::bus && leaves) {
      return Error{"robot '" + robot.name + "': its description on ROBOT names the robot model " +
                   robot.model + "; from there it must be a shipped one, or in the folder of the scenario"};
    }
    robot.model = resolved_model(robot.model, scenario);
    const Status added = add_robot_model([&] { return "robot '" + robot.name + "': "; }, robot.model, models);
    if (!added) return added;
  }
  return {};
}

Result<RobotDescription> load_usable_robot(const std::string& path) {
  auto robot = load_robot_description(path);
  if (!robot) return robot;
  if (const Status usable = tick::check_robot(*robot); !usable)
    return Error{place_of(path, robot->laser ? "footprint" : "laser") + usable.error().message};
  return robot;
}

Result<SessionFiles> load_session_files(const std::string& path, const std::string& robot,
                                        std::optional<std::uint64_t> seed) {
  SessionFiles files;
  auto scenario = load_scenario(path, seed);
  if (!scenario) return scenario.error();
  files.scenario = std::move(*scenario);
  if (const Status level = tick::check_level(files.scenario); !level)
    return Error{place_of(path, "level") + level.error().message};
  if (!files.scenario.model.empty()) {
    std::error_code ignored;  // a name that is too long does not exist either
    if (!std::filesystem::exists(files.scenario.model, ignored))
      return Error{
          place_of(path, "model") + "model " + files.scenario.model + " does not exist" +
          like_it(files.scenario.model) + " `parhelion demo --headless --fast --folder " +
          folder_of(files.scenario.model) +
          "` makes the model of the shipped recording; `parhelion map model` and `map extrude` make one "
          "from your own scans"};
    auto model = load_model(files.scenario.model);
    if (!model) return model.error();
    files.model = std::move(*model);
    if (const Status taken = load_objects(files); !taken) return taken.error();
    auto texture = load_texture_of(files.scenario.model, files.model.map_id);
    if (!texture) return texture.error();
    files.texture = without_objects(std::move(*texture), files.objects);
  }
  if (const Status known = check_hazards(path, files); !known) return known.error();
  if (const Status loaded = load_map(path, files); !loaded) return loaded.error();
  if (const Status loaded = load_robot_models(path, files); !loaded) return loaded.error();
  if (tick::simulates_trainee(files.scenario)) {
    if (!robot.empty())
      return Error{place_of(path, "trainee") +
                   "the trainee's robot is simulated, and its model describes it; remove --robot " + robot};
    auto description = tick::trainee_description(files.scenario, files.robot_models);
    if (!description) return Error{place_of(path, "trainee") + description.error().message};
    files.robot = std::move(*description);
    files.robots = {files.robot};
    return files;
  }
  if (const Status loaded = load_robots(path, robot, files); !loaded) return loaded.error();
  files.robot = files.robots.front();
  return files;
}

Status check_start(const tick::Configuration& configuration, const std::string& path) {
  const auto state = make_session_state(configuration, ArrivalTime{});
  const Status reached = state ? tick::check_reach(configuration) : Status{};
  if (state && reached) return {};
  const std::string& message = state ? reached.error().message : state.error().message;
  return Error{place_of_item(path, configuration.scenario, message) + message};
}

std::optional<std::string> note_without_model(const tick::Configuration& configuration) {
  const Scenario& scenario = configuration.scenario;
  if (tick::simulates_trainee(scenario) || scenario.mapping || !configuration.model.entities.empty())
    return std::nullopt;
  return "the scenario has no 'model': real people and obstacles are not tracked, because a laser cannot "
         "tell "
         "them from walls that are unknown; there is no person_touched, and virtual robots do not avoid them "
         "(docs/build-a-model.md makes a model)";
}

}  // namespace parhelion::runtime
