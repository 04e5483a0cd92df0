// The bodies that MR_WORLD names, numbered, so that a frame of their poses needs no name.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <unordered_map>
#include <vector>

#include "protocols/codec.hpp"
#include "protocols/scene.hpp"

namespace parhelion::station {

class EntityTable {
 public:
  struct Part {
    std::string entity, name;
  };
  struct Entity {
    std::string name;
    BodyOwner owner = BodyOwner::agent;
    AgentKind kind = AgentKind::box;
    std::vector<std::size_t> parts;  ///< numbers
  };
  static constexpr std::size_t most_parts = 65'535;  ///< a number has 16 bits; what is more is not shown

  /// Counts from 1, round in 16 bits; 0: nothing was told yet.
  std::uint16_t number() const { return number_; }
  const std::vector<Part>& parts() const { return parts_; }
  const std::vector<Entity>& entities() const { return entities_; }
  /// Index in entities(); -1: it is not there.
  int entity(const std::string& name) const;

  /// Whether the world has just these bodies, in this order.
  bool fits(const WorldMessage& world) const;
  /// Makes it so.
  void renew(const WorldMessage& world);
  /// The session begins anew: numbers go on.
  void clear();

  /// Binary message 1: the poses of those bodies that the table has. `t`: s of the session; `unsensed`:
  /// agents are not shown to the real robot's sensors now.
  std::string frame(const WorldMessage& world, double t, bool unsensed) const;

 private:
  std::uint16_t number_ = 0;
  std::vector<Part> parts_;
  std::vector<Entity> entities_;
  std::unordered_map<std::string, std::size_t> entity_;  ///< by name
};

}  // namespace parhelion::station
