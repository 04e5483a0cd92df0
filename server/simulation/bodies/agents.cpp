#include "server/simulation/bodies/agents.hpp"

#include <algorithm>
#include <utility>

#include "protocols/nearest_name.hpp"

namespace parhelion::simulation {

Agent* Agents::find(const std::string& name) {
  const auto at = std::find_if(begin(), end(), [&](const Agent& a) { return a.definition.name == name; });
  return at == end() ? nullptr : &*at;
}

const Agent* Agents::find(const std::string& name) const {
  const auto at = std::find_if(begin(), end(), [&](const Agent& a) { return a.definition.name == name; });
  return at == end() ? nullptr : &*at;
}

const Agent* Agents::trainee() const {
  const auto at = std::find_if(begin(), end(), [](const Agent& a) { return a.trainee; });
  return at == end() ? nullptr : &*at;
}

std::size_t Agents::index_of(const Agent& agent) const {
  const auto at =
      std::find_if(agents_.begin(), agents_.end(), [&](const auto& a) { return a.get() == &agent; });
  return static_cast<std::size_t>(at - agents_.begin());
}

Status Agents::unknown(const std::string& name) const {
  std::vector<std::string> names;
  for (const Agent& agent : *this) names.push_back(agent.definition.name);
  if (names.empty()) return Error{"no agent '" + name + "': there are none; spawn it first"};
  return Error{"no agent '" + name + "'" + suggestion_or_known(name, names)};
}

BodyId Agents::take_body_numbers(std::size_t count) {
  return std::exchange(next_body_, next_body_ + static_cast<BodyId>(count));
}

void Agents::add(std::unique_ptr<Agent> agent, const std::vector<BodyDefinition>& bodies) {
  for (const BodyDefinition& body : bodies)
    definitions_.push_back(std::make_shared<const BodyDefinition>(body));
  agents_.push_back(std::move(agent));
}

std::unique_ptr<Agent> Agents::remove(std::size_t index) {
  std::unique_ptr<Agent> agent = std::move(agents_[index]);
  agents_.erase(agents_.begin() + static_cast<std::ptrdiff_t>(index));
  std::erase_if(definitions_, [&](const auto& body) {
    return body->id >= agent->first_body && body->id < agent->first_body + agent->body_count;
  });
  return agent;
}

}  // namespace parhelion::simulation
