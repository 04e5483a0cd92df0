#include "server/tick/operator_admission.hpp"

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

bool SeenNames::repeats(std::string_view name, ArrivalTime now) {
  constexpr std::size_t kPlaces = 4096;
  static_assert(kRepeat < driving_timing::kConsoleHeartbeat);
  places_.resize(kPlaces);
  const std::uint64_t hash = fnv1a(name);
  Place& place = places_[(hash ^ (hash >> 32)) % kPlaces];
  const Duration age = now - place.first;
  if (place.hash == hash && age < driving_timing::kConsoleSilence) return age >= kRepeat;
  place = {hash, now};
  return false;
}

}  // namespace parhelion::tick
