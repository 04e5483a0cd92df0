#include "fusion/semantic/net/drop_doubles.hpp"

#include <set>
#include <string>

#include "protocols/model_overlap.hpp"

namespace parhelion::semantic {

std::size_t drop_doubles(SemanticModel& model, std::size_t given) {
  std::set<std::string> gone;
  std::vector<ModelEntity>& entities = model.entities;
  while (const auto pair = find_overlap(entities)) {
    const auto [first, second] = *pair;
    if (second < given) break;
    const bool surer_second = first >= given && entities[second].confidence > entities[first].confidence;
    const auto drop = entities.begin() + static_cast<std::ptrdiff_t>(surer_second ? first : second);
    gone.insert(drop->name);
    entities.erase(drop);
  }
  std::erase_if(model.relations,
                [&](const Relation& r) { return gone.contains(r.from) || gone.contains(r.to); });
  return gone.size();
}

}  // namespace parhelion::semantic
