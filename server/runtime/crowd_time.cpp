#include "server/runtime/crowd_time.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <vector>

#include "protocols/quantile.hpp"
#include "server/runtime/crowd_memory.hpp"
#include "server/runtime/session_state.hpp"
#include "server/tick/state.hpp"

namespace parhelion::runtime {
namespace {

constexpr std::size_t kSmallCrowd = 300;  // simulated in real time by every supported machine
constexpr std::size_t kProbed = 1000;  // agents: the cost per agent grows with their number, as caches fill
constexpr int kWarmUp = 24, kTimed = 48;  // steps: a fifth of a second, in which each agent decides
constexpr double kUsableFraction = 0.7;   // of real time; the rest is for sensors, scans and messages

std::size_t asked_for(const Scenario& scenario) {
  const auto limit = static_cast<std::size_t>(scenario.max_agents);
  return limit > Scenario{}.max_agents ? std::max(limit, scenario.agents.size()) : scenario.agents.size();
}

std::string milliseconds_text(double seconds) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g ms", seconds * 1e3);
  return text;
}

}  // namespace

std::optional<CrowdStep> time_crowd(const tick::Configuration& configuration, std::size_t limit) {
  tick::Configuration part = configuration;
  auto& agents = part.scenario.agents;
  if (agents.size() > limit) agents.resize(limit);
  part.scenario.max_agents = std::max<std::uint64_t>(Scenario{}.max_agents, agents.size() + 1);
  // Scripts and grading may name agents that are left out here.
  part.scenario.scripts.clear();
  part.scenario.training.reset();
  const auto state = make_session_state(part, ArrivalTime{});
  if (!state || agents.empty()) return std::nullopt;
  std::vector<simulation::LaserRequest> requests;
  std::array<double, kTimed> seconds{};
  for (int i = 0; i < kWarmUp + kTimed; ++i) {
    requests.clear();
    const auto begun = std::chrono::steady_clock::now();
    (*state)->simulation.step(std::nullopt, requests);
    if (i >= kWarmUp)
      seconds[static_cast<std::size_t>(i - kWarmUp)] =
          std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
    (*state)->simulation.take_events();
  }
  return CrowdStep{agents.size(), median(seconds)};
}

std::optional<std::string> slow_crowd(const Scenario& scenario, const CrowdStep& measured) {
  const std::size_t agents = asked_for(scenario);
  const double each = measured.seconds / static_cast<double>(measured.agents);
  const double expected = each * static_cast<double>(agents), period = 1 / scenario.physics_rate;
  if (expected <= kUsableFraction * period) return std::nullopt;
  const auto fit = static_cast<std::size_t>(kUsableFraction * period / each);
  char rate[32];
  std::snprintf(rate, sizeof rate, "%.0f Hz", std::floor(0.99 * kUsableFraction / expected));
  return "warning: a physics step with " + std::to_string(agents) + " agents is expected to take at least " +
         milliseconds_text(expected) + " on this machine (" + milliseconds_text(measured.seconds) + " with " +
         std::to_string(measured.agents) + "), and " + milliseconds_text(period) +
         " are available: steps will be skipped, and agents will move in jumps. Ask for at most " +
         std::to_string(fit) + " agents, or for a physics_rate of " + rate + ", or use a faster machine";
}

std::optional<std::string> warn_of_slow_crowd(const tick::Configuration& configuration) {
  if (asked_for(configuration.scenario) <= kSmallCrowd) return std::nullopt;
  const auto measured = time_crowd(configuration, kProbed);
  return measured ? slow_crowd(configuration.scenario, *measured) : std::nullopt;
}

}  // namespace parhelion::runtime
