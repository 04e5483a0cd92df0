#include "server/station/entity_table.hpp"

#include <algorithm>

#include "server/station/byte_writer.hpp"

namespace parhelion::station {
namespace {

constexpr std::size_t kHeaderBytes = 16, kBodyBytes = 32;

void put_body(const WorldMessage::Entry& body, std::size_t part, bool undetectable, bool remembered,
              ByteWriter& bytes) {
  const bool guessed = body.owner == BodyOwner::real_robot && !body.attitude_known;
  const bool unseen = body.owner == BodyOwner::agent && undetectable;
  bytes.put(static_cast<std::uint16_t>(part));
  bytes.put(static_cast<std::uint16_t>((guessed ? 1 : 0) | (unseen ? 2 : 0) | (remembered ? 4 : 0)));
  for (const double coordinate : body.T_map_body.translation()) bytes.put(static_cast<float>(coordinate));
  const Eigen::Quaternionf turn = body.T_map_body.quaternion().cast<float>();
  for (const float component : {turn.x(), turn.y(), turn.z(), turn.w()}) bytes.put(component);
}

}  // namespace

int EntityTable::entity(const std::string& name) const {
  const auto found = entity_.find(name);
  return found == entity_.end() ? -1 : static_cast<int>(found->second);
}

bool EntityTable::fits(const WorldMessage& world) const {
  return number_ != 0 && std::min(world.bodies.size(), kMaxParts) == parts_.size() &&
         std::equal(parts_.begin(), parts_.end(), world.bodies.begin(),
                    [](const Part& part, const WorldMessage::Entry& body) {
                      return part.entity == body.entity && part.name == body.part;
                    });
}

void EntityTable::renew(const WorldMessage& world) {
  clear();
  number_ = static_cast<std::uint16_t>(number_ == 65'535 ? 1 : number_ + 1);
  for (const WorldMessage::Entry& body : world.bodies) {
    if (parts_.size() == kMaxParts) break;
    const auto [place, is_new] = entity_.try_emplace(body.entity, entities_.size());
    if (is_new) entities_.push_back({body.entity, body.owner, body.kind, {}});
    entities_[place->second].parts.push_back(parts_.size());
    parts_.push_back({body.entity, body.part});
  }
}

void EntityTable::clear() {
  parts_.clear();
  entities_.clear();
  entity_.clear();
}

std::string EntityTable::frame(const WorldMessage& world, double t, bool undetectable,
                               const Remembered& remembered) const {
  std::vector<std::pair<std::size_t, std::size_t>> shown;  // part, body
  shown.reserve(parts_.size());
  std::size_t part = 0;
  // Both are sorted by body number; new and missing bodies are skipped.
  for (std::size_t body = 0; body < world.bodies.size() && part < parts_.size(); ++body) {
    const auto is = [&](const Part& each) {
      return each.name == world.bodies[body].part && each.entity == world.bodies[body].entity;
    };
    const auto found = std::find_if(parts_.begin() + static_cast<std::ptrdiff_t>(part), parts_.end(), is);
    if (found == parts_.end()) continue;
    part = static_cast<std::size_t>(found - parts_.begin());
    shown.emplace_back(part++, body);
  }
  ByteWriter bytes(kHeaderBytes + kBodyBytes * shown.size());
  bytes.put(std::uint8_t{1});
  bytes.put(std::uint8_t{0});
  bytes.put(number_);
  bytes.put(static_cast<std::uint32_t>(shown.size()));
  bytes.put(t);
  for (const auto& [number, body] : shown) {
    const WorldMessage::Entry& each = world.bodies[body];
    put_body(each, number, undetectable, remembered && remembered(each.entity), bytes);
  }
  return bytes.take();
}

}  // namespace parhelion::station
