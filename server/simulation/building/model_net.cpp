#include "server/simulation/building/model_net.hpp"

namespace parhelion::simulation {

ModelNet::ModelNet(const SemanticModel& model) {
  for (const ModelEntity& entity : model.entities) {
    if (!entity.deleted) entries_[entity.name] = {entity.label, entity.part_of, {}, {}};
  }
  for (const Relation& relation : model.relations) {
    for (const std::string* name : {&relation.from, &relation.to}) {
      const auto entry = entries_.find(*name);
      if (entry != entries_.end()) entry->second.relations.push_back(relation);
    }
  }
  for (auto& [name, entry] : entries_) entry.place = place_of(name, entry);
}

const std::vector<Relation>& ModelNet::relations(std::string_view entity) const {
  static const std::vector<Relation> none;
  const auto entry = entries_.find(entity);
  return entry == entries_.end() ? none : entry->second.relations;
}

const std::string& ModelNet::place(std::string_view entity) const {
  static const std::string nowhere;
  const auto entry = entries_.find(entity);
  return entry == entries_.end() ? nowhere : entry->second.place;
}

/// A wall with doors consists of several pieces; the result names the wall that they are part of.
std::string ModelNet::place_of(const std::string& name, const Entry& entry) const {
  const bool opening = entry.label == EntityLabel::door || entry.label == EntityLabel::window ||
                       entry.label == EntityLabel::free_space;
  if (!entry.part_of.empty()) return (opening ? "in " : "of ") + entry.part_of;
  if (!opening) return {};
  for (const RelationKind kind : {RelationKind::connected_via_joint, RelationKind::available_inside}) {
    for (const Relation& relation : entry.relations) {
      if (relation.kind != kind || relation.from != name) continue;
      const auto wall = entries_.find(relation.to);
      const bool piece = wall != entries_.end() && !wall->second.part_of.empty();
      return "in " + (piece ? wall->second.part_of : relation.to);
    }
  }
  return {};
}

}  // namespace parhelion::simulation
