#include "server/tick/fault_path.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "fusion/scan/lidar_model.hpp"

namespace parhelion::tick {
namespace {

constexpr std::uint64_t kDropoutsSeed = 0x9d5c0fb26c6e3a11U;  // independent of the range noise

std::vector<const Fault*> active_faults(const FaultState& faults, Fault::Kind kind) {
  std::vector<const Fault*> active;
  for (const TimedFault& each : faults.faults) {
    if (each.active && each.fault.kind == kind) active.push_back(&each.fault);
  }
  return active;
}

Status check_fault(const Configuration& configuration, const Fault& fault) {
  const std::string name = to_string(fault.kind);
  if (fault.kind == Fault::Kind::low_battery)
    return Error{"'low_battery' is how a session starts: put it into the scenario's 'faults'"};
  if (needs_simulated_robot(fault.kind) && !simulates_trainee(configuration.scenario))
    return Error{"'" + name +
                 "' is a fault for simulated robots: a real robot's sensors and drive are not changed"};
  const double max_amount = fault.kind == Fault::Kind::camera_delay ? 0.5 : 1;
  if (fault.kind != Fault::Kind::dead_wheel && !(fault.amount >= 0 && fault.amount <= max_amount))
    return Error{"fault '" + name + "': its amount is " + std::to_string(fault.amount) + ", expected 0 to " +
                 (max_amount < 1 ? "0.5 s" : "1")};
  return {};
}

/// First fault started by command; the scenario's faults come before it.
std::vector<TimedFault>::iterator first_instructor_fault(const Configuration& configuration,
                                                         FaultState& faults) {
  return faults.faults.begin() + static_cast<std::ptrdiff_t>(configuration.scenario.faults.size());
}

/// Ends the faults of a kind, and of one side if given. False: there are none.
bool end_instructor_faults(const Configuration& configuration, Fault::Kind kind, std::optional<bool> right,
                           double age, FaultState& faults) {
  bool any = false;
  for (auto each = first_instructor_fault(configuration, faults); each != faults.faults.end(); ++each) {
    Fault& fault = each->fault;
    if (fault.kind != kind || (right && fault.right != *right) || !fault.holds(age)) continue;
    fault.lasting = age - fault.after;
    any = true;
  }
  return any;
}

void block_dead_sides(const Configuration& configuration, const FaultState& faults,
                      simulation::Simulation& simulation) {
  bool left = false, right = false;
  for (const Fault* fault : active_faults(faults, Fault::Kind::dead_wheel))
    (fault->right ? right : left) = true;
  simulation.block_sides(configuration.robot.name, left, right);
}

}  // namespace

void update_faults(const TickContext& context, FaultState& faults, simulation::Simulation& simulation) {
  for (auto& [fault, was_active] : faults.faults) {
    const bool active = fault.holds((context.now - faults.started).seconds());
    if (active == was_active) continue;
    was_active = active;
    Event event;
    event.stamp = context.now;
    event.kind = active ? EventKind::fault_started : EventKind::fault_ended;
    event.subject = context.configuration.robot.name;
    event.object = to_string(fault.kind);
    event.value = fault.amount;
    if (fault.kind == Fault::Kind::dead_wheel) {
      event.text = fault.right ? "right" : "left";
      block_dead_sides(context.configuration, faults, simulation);
    }
    publish_event(context, event);
  }
}

Status process_fault_command(const TickContext& context, const FaultCommand& command, FaultState& faults) {
  const Configuration& configuration = context.configuration;
  const double age = (context.now - faults.started).seconds();
  if (!command.begins) {
    if (end_instructor_faults(configuration, command.kind, std::nullopt, age, faults)) return {};
    return Error{"fault '" + std::string(to_string(command.kind)) + "' is not active, so it cannot be ended"};
  }
  const bool wheel = command.kind == Fault::Kind::dead_wheel;
  Fault fault;
  fault.kind = command.kind;
  fault.amount = wheel ? 0 : command.amount;
  fault.right = wheel && command.right;
  fault.after = age;
  fault.lasting = command.duration;
  if (const Status fits = check_fault(configuration, fault); !fits) return fits;
  end_instructor_faults(configuration, command.kind, wheel ? std::optional(fault.right) : std::nullopt, age,
                        faults);
  // Drops finished faults: an instructor may start any number.
  faults.faults.erase(
      std::remove_if(first_instructor_fault(configuration, faults), faults.faults.end(),
                     [&](const TimedFault& each) { return !each.active && !each.fault.holds(age); }),
      faults.faults.end());
  faults.faults.push_back({fault});
  return {};
}

void drop_beams(const Configuration& configuration, const FaultState& faults, const LaserDescription& laser,
                std::uint64_t sequence, Scan& scan, std::span<scan::RangeHit> body_hits) {
  double kept = 1;
  for (const Fault* fault : active_faults(faults, Fault::Kind::laser_dropouts)) kept *= 1 - fault->amount;
  if (kept == 1) return;
  const scan::NoiseKey key{configuration.scenario.seed ^ kDropoutsSeed, sequence};
  const auto nothing = laser.convention.no_return_sentinel();
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double drawn = 0.5 * std::erfc(-scan::standard_normal(key, i) / std::sqrt(2.0));  // uniform, 0 to 1
    if (drawn >= 1 - kept) continue;
    scan.ranges[i] = nothing;
    body_hits[i].body = -1;  // for MR_SCAN_INFO
  }
}

}  // namespace parhelion::tick
