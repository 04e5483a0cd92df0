#include "server/tick/operator_admission.hpp"

#include <algorithm>
#include <span>

#include "protocols/driving_timing.hpp"
#include "protocols/hash.hpp"

namespace parhelion::tick {

bool SwitchBudget::spend(SimulationTime now) {
  if (now - since_ >= seconds(1.0)) {
    since_ = now;
    count_ = 0;
  }
  return ++count_ <= kMaxPerSecond;
}

std::optional<ArrivalTime> SeenNames::repeated_since(std::string_view name, ArrivalTime now) {
  constexpr std::size_t kGroups = 1024, kInGroup = 4;
  static_assert(kRepeat < driving_timing::kConsoleHeartbeat);
  places_.resize(kGroups * kInGroup);
  const std::uint64_t hash = fnv1a(name);
  const auto group = std::span(places_).subspan((hash ^ (hash >> 32)) % kGroups * kInGroup, kInGroup);
  auto place = std::find_if(group.begin(), group.end(), [&](const Place& each) { return each.hash == hash; });
  if (place != group.end()) {
    const Duration age = now - place->first;
    if (age < driving_timing::kConsoleSilence)
      return age >= kRepeat ? std::optional(place->first) : std::nullopt;
  } else {
    place = std::min_element(group.begin(), group.end(),
                             [](const Place& a, const Place& b) { return a.first < b.first; });
  }
  *place = {hash, now};
  return std::nullopt;
}

}  // namespace parhelion::tick
