// Access to the semantic net: from the name in an event to the entity and its relations.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/model.hpp"

namespace parhelion::simulation {

class ModelNet {
 public:
  ModelNet() = default;
  explicit ModelNet(const SemanticModel& model);

  bool has(std::string_view entity) const { return entries_.find(entity) != entries_.end(); }
  /// Relations from or to the entity, in the order of the model; none for an unknown one.
  const std::vector<Relation>& relations(std::string_view entity) const;
  /// Addition to the name in events: "in wall 7" for a door or a window, "of stairs 1" for a step; empty if
  /// the net has no such relation.
  const std::string& place(std::string_view entity) const;

 private:
  struct Entry {
    EntityLabel label = EntityLabel::unknown;
    std::string part_of;
    std::vector<Relation> relations;
    std::string place;
  };
  std::string place_of(const std::string& name, const Entry& entry) const;
  std::map<std::string, Entry, std::less<>> entries_;
};

}  // namespace parhelion::simulation
