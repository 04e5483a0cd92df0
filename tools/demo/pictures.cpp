#include "tools/demo/pictures.hpp"

#include "fusion/semantic/pictures/plan_picture.hpp"

namespace parhelion::tools {
namespace {

std::string real_robot(const Witness& witness) {
  if (!witness.best_scan()) return {};
  for (const auto& body : witness.best_scan()->world.scene->bodies) {
    if (body->owner == BodyOwner::real_robot) return body->entity;
  }
  return {};
}

}  // namespace

Status draw_map_picture(const std::string& path, const pose::GridMap& map, const SemanticModel& model,
                        const Witness& witness) {
  semantic::PlanPicture picture;
  picture.title = "Parhelion: a real robot among virtual ones";
  picture.map = &map;
  picture.focus = 6;
  picture.model = &model;
  picture.paths.push_back({"real robot", {31, 111, 235}, witness.driven(), real_robot(witness)});
  // Neither red nor turquoise, which are the colours of returns.
  const semantic::Colour colours[] = {{130, 60, 200}, {230, 140, 0}, {20, 140, 60}, {150, 90, 40}};
  std::size_t next = 0;
  for (const auto& [name, points] : witness.agent_paths()) {
    picture.paths.push_back({name + " (virtual)", colours[next++ % std::size(colours)], points, name});
  }
  if (const auto& seen = witness.best_scan()) {
    picture.subtitle = std::to_string(seen->virtual_returns.size()) + " virtual of " +
                       std::to_string(seen->virtual_returns.size() + seen->real_returns.size()) +
                       " returns in the scan that is drawn";
    picture.world = &seen->world;
    picture.scan = semantic::PlanScan{seen->T_map_laser.translation().head<2>(), seen->real_returns,
                                      seen->virtual_returns};
  }
  return semantic::draw_plan(picture, path);
}

}  // namespace parhelion::tools
