// The semantic net behind the bodies: from the name in an event to what the thing is and what it hangs on.
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
  /// Relations that name the entity, from or to, in the order of the model; none of an unknown one.
  const std::vector<Relation>& relations(std::string_view entity) const;
  /// What an event adds to the name: "in wall 7" of a door or a window, "of stairs 1" of a step; empty where
  /// the net has nothing about it.
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
