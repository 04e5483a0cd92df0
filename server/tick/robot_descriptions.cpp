#include "server/tick/robot_descriptions.hpp"

#include "server/tick/configuration.hpp"

namespace parhelion::tick {
namespace {

constexpr std::string_view kSeparator = "\n---\n";

}  // namespace

Status name_robots(const Scenario& scenario, std::vector<RobotDescription>& robots) {
  const std::size_t expected = std::max<std::size_t>(1, scenario.robots.size());
  if (robots.size() != expected) {
    return Error{"scenario '" + scenario.name + "': " + std::to_string(robots.size()) +
                 " robot descriptions for " + std::to_string(expected) + " robots; give one for each"};
  }
  for (std::size_t i = 0; i < scenario.robots.size(); ++i) robots[i].name = scenario.robots[i].name;
  return {};
}

std::string to_yaml_documents(const std::vector<RobotDescription>& robots) {
  std::string documents;
  for (const RobotDescription& robot : robots) {
    if (!documents.empty()) documents += "---\n";
    documents += to_yaml(robot);
  }
  return documents;
}

std::string to_yaml_documents(const Configuration& configuration) {
  std::vector<RobotDescription> robots{configuration.robot};
  robots.insert(robots.end(), configuration.other_robots.begin(), configuration.other_robots.end());
  return to_yaml_documents(robots);
}

Result<std::vector<RobotDescription>> parse_robot_descriptions(const std::string& documents,
                                                               const std::string& origin) {
  std::vector<RobotDescription> robots;
  for (std::size_t begin = 0; begin != std::string::npos;) {
    const std::size_t end = documents.find(kSeparator, begin);
    const std::size_t size = end == std::string::npos ? end : end + 1 - begin;
    auto robot = parse_robot_description(documents.substr(begin, size), origin);
    if (!robot) return robot.error();
    robots.push_back(std::move(*robot));
    begin = end == std::string::npos ? end : end + kSeparator.size();
  }
  return robots;
}

}  // namespace parhelion::tick
