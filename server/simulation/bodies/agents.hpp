// All agents, in the order of their spawns, and their body definitions.
#pragma once

#include <cstddef>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "protocols/scene.hpp"
#include "protocols/status.hpp"
#include "server/simulation/bodies/agent.hpp"

namespace parhelion::simulation {

class Agents {
  /// Iterates over the pointers and dereferences them.
  template <class At, class Value>
  struct Iterator {
    using iterator_category = std::forward_iterator_tag;
    using value_type = Value;
    using difference_type = std::ptrdiff_t;
    using pointer = Value*;
    using reference = Value&;
    At at;
    Value& operator*() const { return **at; }
    Value* operator->() const { return at->get(); }
    Iterator& operator++() {
      ++at;
      return *this;
    }
    Iterator operator++(int) {
      Iterator before = *this;
      ++at;
      return before;
    }
    bool operator==(const Iterator&) const = default;
  };
  using Pointers = std::vector<std::unique_ptr<Agent>>;

 public:
  using iterator = Iterator<Pointers::iterator, Agent>;
  using const_iterator = Iterator<Pointers::const_iterator, const Agent>;

  iterator begin() { return {agents_.begin()}; }
  iterator end() { return {agents_.end()}; }
  const_iterator begin() const { return {agents_.begin()}; }
  const_iterator end() const { return {agents_.end()}; }
  std::size_t size() const { return agents_.size(); }
  Agent& operator[](std::size_t i) { return *agents_[i]; }
  const Agent& operator[](std::size_t i) const { return *agents_[i]; }

  /// nullptr: no such agent.
  Agent* find(const std::string& name);
  const Agent* find(const std::string& name) const;
  /// The trainee's simulated robot, or nullptr.
  const Agent* trainee() const;
  std::size_t index_of(const Agent& agent) const;
  /// The error for an unknown agent name.
  Status unknown(const std::string& name) const;

  /// Body ids are assigned from this one on.
  void number_bodies_from(BodyId first) { next_body_ = first; }
  /// Reserves `count` ids; returns the first.
  BodyId take_body_numbers(std::size_t count);
  /// 0 for the first agent ever, 1 for the second, ...
  std::uint64_t take_spawn_number() { return next_spawn_++; }
  void add(std::unique_ptr<Agent> agent, const std::vector<BodyDefinition>& bodies);
  std::unique_ptr<Agent> remove(std::size_t index);

  BodyId next_body() const { return next_body_; }
  /// Of all agents' bodies, ascending id.
  const std::vector<std::shared_ptr<const BodyDefinition>>& definitions() const { return definitions_; }

 private:
  Pointers agents_;  // ascending first_body
  std::vector<std::shared_ptr<const BodyDefinition>> definitions_;
  std::uint64_t next_spawn_ = 0;
  BodyId next_body_ = 1;
};

}  // namespace parhelion::simulation
