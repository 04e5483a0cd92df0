#include "server/tick/beam_watch.hpp"

#include <utility>

#include "protocols/channels.hpp"

namespace parhelion::tick {
namespace {

/// Of the base since the scan before, by odometry; nullopt: unknown.
std::optional<Pose2> step_since(const std::optional<SensorTime>& before, SensorTime stamp,
                                const pose::PoseTrack& track) {
  if (!before) return std::nullopt;
  const auto from = track.odometry_at(*before), to = track.odometry_at(stamp);
  if (!from || !to) return std::nullopt;
  return from->inverse() * *to;
}

void report(const TickContext& context, std::size_t laser, const std::string& laser_name,
            const pose::BeamOrder& order) {
  Event event;
  event.stamp = context.now;
  event.kind = EventKind::scans_conflict;
  event.subject = context.robot().name;
  event.object = laser_name;
  event.text = context.channel(channel::kScan, laser) + ": " + order.advice() +
               "; until now virtual objects were misplaced while the robot turned";
  publish_event(context, event);
}

}  // namespace

void watch_beam_order(const TickContext& context, const Scan& scan, std::size_t laser,
                      const std::string& laser_name, PoseState& pose, BeamWatch& watch) {
  // A simulated laser is as it is described.
  if (watch.concluded || simulates_trainee(context.configuration.scenario)) return;
  const LaserDescription& described = context.robot().laser_at(laser);
  if (!watch.order) watch.order.emplace(described);
  watch.order->add(scan, step_since(watch.newest, scan.stamp, pose.track));
  watch.newest = scan.stamp;
  if (!watch.order->done()) return;
  if (watch.order->differs()) {
    watch.corrected = described;
    watch.order->correct(*watch.corrected);
    // What it has learned of the map's accuracy came from bent scans.
    if (laser == 0 && pose.refiner) pose.refiner.emplace(*watch.corrected, context.configuration.map);
    report(context, laser, laser_name, *watch.order);
  }
  watch.concluded = true;
  watch.order.reset();
}

}  // namespace parhelion::tick
