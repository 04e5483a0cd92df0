// Numbers the bodies of MR_WORLD, so that a frame of their poses contains no names.
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
    std::vector<std::size_t> parts;  ///< numbers of bodies
  };
  static constexpr std::size_t kMaxParts = 65'535;  ///< numbers have 16 bits; further bodies are not shown

  EntityTable() = default;
  /// Numbers are counted from `number` + 1.
  explicit EntityTable(std::uint16_t number) : number_(number) {}

  /// Counts up and wraps around at 16 bits. It is of use only if there are parts.
  std::uint16_t number() const { return number_; }
  const std::vector<Part>& parts() const { return parts_; }
  const std::vector<Entity>& entities() const { return entities_; }
  /// Index in entities(); -1: no such entity.
  int entity(const std::string& name) const;

  /// True if the world has exactly these bodies in this order.
  bool fits(const WorldMessage& world) const;
  /// Takes over the bodies of the world.
  void renew(const WorldMessage& world);
  /// For a new session; numbers are not reused.
  void clear();

  /// Entities of which only the past is known.
  using Remembered = std::function<bool(const std::string& entity)>;
  /// Binary message 1: poses of the bodies in the table. `t`: s of the session; `undetectable`: agents are
  /// not injected into the real robot's sensors now; `remembered` may be empty.
  std::string frame(const WorldMessage& world, double t, bool undetectable,
                    const Remembered& remembered = {}) const;

 private:
  std::uint16_t number_ = 0;
  std::vector<Part> parts_;
  std::vector<Entity> entities_;
  std::unordered_map<std::string, std::size_t> entity_;  ///< by name
};

}  // namespace parhelion::station
