#include "fusion/scan/augment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "fusion/scan/range_noise.hpp"

namespace parhelion::scan {
namespace {

constexpr RangeHit kNothing{std::numeric_limits<float>::infinity(), -1, 0};

bool is_hit(const RangeHit& hit) {
  return hit.body >= 0 && hit.range < std::numeric_limits<float>::infinity();
}

/// Whether the sensor would report a virtual return: it is nearer than the real one.
bool nearer_than_real(const Measurement& virtual_return, BeamKind real_kind, float real_range,
                      float true_range, const RangeHit* wall) {
  switch (real_kind) {
    case BeamKind::hit:
      return virtual_return.kind == BeamKind::too_close ||
             (virtual_return.kind == BeamKind::hit && virtual_return.range < real_range);
    case BeamKind::no_return:
      // The wall may have absorbed the real beam (glass, black paint): nothing behind it is shown, noise
      // included.
      return wall != nullptr && true_range < wall->range &&
             (virtual_return.kind == BeamKind::too_close ||
              (virtual_return.kind == BeamKind::hit && virtual_return.range < wall->range));
    case BeamKind::too_close:
    case BeamKind::invalid:
      return false;
  }
  return false;
}

/// In the sensor's own unit: as learned, else by reflectivity.
float intensity(const LaserDescription& laser, NoiseKey key, std::size_t beam, float reflectivity) {
  if (!laser.intensity_codes.empty()) return sample_intensity(laser, key, beam);
  return static_cast<float>(laser.intensity_scale * double{reflectivity});
}

/// Tangent of the angle of incidence, from the next beam that hits the same body; 0 where there is none.
double tan_incidence(std::span<const RangeHit> hits, std::size_t i, const Scan& scan) {
  const std::size_t next = i + 1 < hits.size() && hits[i + 1].body == hits[i].body ? i + 1 : i - 1;
  if (next >= hits.size() || hits[next].body != hits[i].body || !is_hit(hits[next])) return 0;
  const double turn = std::remainder(scan.angle(next) - scan.angle(i), 2 * std::numbers::pi);
  const double across = double{hits[i].range} * std::abs(turn);
  constexpr double kGrazing = 4;  // as an edge of a body is no surface
  return across > 0 ? std::min(kGrazing, std::abs(double{hits[next].range} - double{hits[i].range}) / across)
                    : 0;
}

}  // namespace

std::size_t augment_scan(const Scan& real, const LaserDescription& laser, NoiseKey key,
                         std::span<const RangeHit> virtual_hits, std::span<const RangeHit> building_hits,
                         Scan& out, std::vector<std::int32_t>& beam_body) {
  if (&out != &real) out = real;
  beam_body.assign(real.ranges.size(), -1);
  const bool has_intensities = out.intensities.size() == out.ranges.size();
  const std::size_t beams = std::min(out.ranges.size(), virtual_hits.size());
  std::size_t replaced = 0;
  for (std::size_t i = 0; i < beams; ++i) {
    const RangeHit& hit = virtual_hits[i];
    if (!is_hit(hit)) continue;
    const float real_range = out.ranges[i];
    const BeamKind kind = laser.convention.classify(real_range);
    if (kind == BeamKind::invalid || kind == BeamKind::too_close) continue;
    const Measurement measured =
        measure_surface(laser, key, i, hit.range, tan_incidence(virtual_hits, i, out));
    const RangeHit* wall = i < building_hits.size() ? &building_hits[i] : nullptr;
    if (!nearer_than_real(measured, kind, real_range, hit.range, wall)) continue;
    out.ranges[i] = measured.range;
    if (has_intensities) out.intensities[i] = intensity(laser, key, i, hit.reflectivity);
    beam_body[i] = hit.body;
    ++replaced;
  }
  return replaced;
}

void simulate_scan(const LaserDescription& laser, NoiseKey key, std::span<const RangeHit> body_hits,
                   std::span<const RangeHit> building_hits, SensorTime stamp, Scan& out) {
  out.stamp = stamp;
  out.angle_min = static_cast<float>(laser.angle_min);
  out.angle_increment = static_cast<float>(laser.angle_increment);
  out.angles.clear();
  out.times.clear();
  out.intensities.resize(laser.intensities ? body_hits.size() : 0);
  out.ranges.resize(body_hits.size());
  for (std::size_t i = 0; i < body_hits.size(); ++i) {
    const RangeHit& wall = i < building_hits.size() ? building_hits[i] : kNothing;
    const RangeHit& nearest = wall.range < body_hits[i].range ? wall : body_hits[i];
    const Measurement measured = measure(laser, key, i, nearest.range);
    out.ranges[i] = measured.range;
    const bool returned = measured.kind == BeamKind::hit || measured.kind == BeamKind::too_close;
    if (laser.intensities) out.intensities[i] = returned ? intensity(laser, key, i, nearest.reflectivity) : 0;
  }
}

}  // namespace parhelion::scan
