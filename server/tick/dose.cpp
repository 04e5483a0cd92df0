#include "server/tick/dose.hpp"

#include <optional>

namespace parhelion::tick {
namespace {

constexpr double kSecondsPerHour = 3600, kSecondsPerMinute = 60;

const char* unit_of(HazardKind kind) { return kind == HazardKind::gas ? "ppm min" : "uSv"; }

Event reached(EventKind what, HazardKind kind, double dose) {
  Event event;
  event.kind = what;
  event.object = to_string(kind);
  event.value = dose;
  event.text = unit_of(kind);
  return event;
}

}  // namespace

void DoseMeter::add(const HazardReading& truth, double period, const DoseLimits& limits,
                    std::vector<Event>& events) {
  for (const HazardReading::Value& value : truth.values) {
    const bool is_gas = value.kind == HazardKind::gas;
    double& dose = is_gas ? gas_ : radiation_;
    const DoseLimits::Limit& limit = is_gas ? limits.gas : limits.radiation;
    const double before = dose;
    dose += value.value * period / (is_gas ? kSecondsPerMinute : kSecondsPerHour);
    const auto reaches = [&](const std::optional<double>& at) { return at && before < *at && dose >= *at; };
    if (reaches(limit.warning)) events.push_back(reached(EventKind::dose_warning, value.kind, dose));
    if (reaches(limit.limit)) events.push_back(reached(EventKind::dose_limit, value.kind, dose));
  }
}

void DoseMeter::append_to(HazardReading& reading) const {
  const std::size_t rates = reading.values.size();
  for (std::size_t i = 0; i < rates; ++i) {
    const HazardKind kind = reading.values[i].kind;
    reading.values.push_back({kind, kind == HazardKind::gas ? gas_ : radiation_, unit_of(kind)});
  }
}

}  // namespace parhelion::tick
