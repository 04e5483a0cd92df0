#include "fusion/semantic/keep_corrections.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "protocols/model_overlap.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kNoise = 0.05;  ///< m
constexpr double kSame = 0.4;    ///< fraction of the smaller one's volume

bool corrected(const ModelEntity& entity) { return entity.locked || entity.deleted || entity.is_virtual; }

bool same_place(const ModelEntity& a, const ModelEntity& b) {
  if ((a.label == EntityLabel::free_space) != (b.label == EntityLabel::free_space)) return false;
  const bool flat_a = is_ground(a.label) || a.label == EntityLabel::ceiling;
  const bool flat_b = is_ground(b.label) || b.label == EntityLabel::ceiling;
  if (flat_a != flat_b) return false;
  // A door lies in its wall: deleting one does not affect the other.
  const bool opening_a = a.label == EntityLabel::door || a.label == EntityLabel::window;
  const bool opening_b = b.label == EntityLabel::door || b.label == EntityLabel::window;
  if (opening_a != opening_b && std::max(a.size.x(), b.size.x()) > 1.5 * std::min(a.size.x(), b.size.x()))
    return false;
  ModelEntity grown_a = a, grown_b = b;
  grown_a.size.array() += 2 * kNoise;
  grown_b.size.array() += 2 * kNoise;
  return overlap_fraction(grown_a, grown_b) > kSame;
}

std::string free_name(const std::string& wanted, const std::set<std::string>& taken) {
  if (!taken.contains(wanted)) return wanted;
  for (int n = 2;; ++n) {
    const std::string name = wanted + " (" + std::to_string(n) + ")";
    if (!taken.contains(name)) return name;
  }
}

}  // namespace

KeptCorrections keep_corrections(const SemanticModel& old, SemanticModel& made) {
  KeptCorrections result;
  const Transform<Map, Map> T_new_old = made.T_map_cloud * old.T_map_cloud.inverse();
  const bool same_frame = made.T_map_cloud.isometry().matrix() == old.T_map_cloud.isometry().matrix();
  std::vector<ModelEntity> kept;
  for (ModelEntity entity : old.entities) {
    if (!corrected(entity)) continue;
    if (!same_frame) entity.T_map_body = T_new_old * entity.T_map_body;
    result.deleted += entity.deleted;
    result.locked += !entity.deleted && entity.locked;
    result.drawn += !entity.deleted && !entity.locked;
    kept.push_back(std::move(entity));
  }

  std::map<std::string, std::string> renamed;  // new run's name to the name of the kept entity; "": removed
  std::vector<ModelEntity> fresh;
  for (ModelEntity& entity : made.entities) {
    const auto owner = std::find_if(kept.begin(), kept.end(), [&](const ModelEntity& k) {
      // A drawn pane may overlap measured entities; it removes none.
      return (k.locked || k.deleted) && same_place(k, entity);
    });
    if (owner == kept.end()) {
      fresh.push_back(std::move(entity));
      continue;
    }
    renamed[entity.name] = owner->deleted ? "" : owner->name;
    result.replaced.push_back(entity.name);
  }
  std::set<std::string> taken;
  for (const ModelEntity& entity : kept) taken.insert(entity.name);
  for (ModelEntity& entity : fresh) {
    const std::string name = free_name(entity.name, taken);
    taken.insert(name);
    if (name != entity.name) renamed[entity.name] = name;
    entity.name = name;
  }
  made.entities = std::move(fresh);
  made.entities.insert(made.entities.end(), kept.begin(), kept.end());

  std::vector<Relation> relations;
  std::set<std::tuple<RelationKind, std::string, std::string>> seen;
  for (Relation& relation : made.relations) {
    for (std::string* name : {&relation.from, &relation.to}) {
      const auto found = renamed.find(*name);
      if (found != renamed.end()) *name = found->second;
    }
    if (relation.from.empty() || relation.to.empty() || relation.from == relation.to) continue;
    if (seen.emplace(relation.kind, relation.from, relation.to).second) relations.push_back(relation);
  }
  made.relations = std::move(relations);
  return result;
}

}  // namespace parhelion::semantic
