#include "fusion/scan/augment.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "tests/fusion/scan/random_scene.hpp"

namespace parhelion::scan {
namespace {

using test::Draw;

constexpr float kInf = std::numeric_limits<float>::infinity();

std::uint32_t bits(float x) { return std::bit_cast<std::uint32_t>(x); }

/// A random convention among those of real sensors.
LaserDescription random_laser(Draw& draw) {
  using Sentinel = RangeConvention::Sentinel;
  LaserDescription laser;
  RangeConvention& c = laser.convention;
  c.range_min = draw.chance(0.2) ? 0 : static_cast<float>(draw.real(0.01, 0.5));
  c.range_max = draw.chance(0.5) ? 80 : static_cast<float>(draw.real(4, 100));
  c.no_return = static_cast<Sentinel>(draw.integer(0, 2));
  const float no_return[] = {81.83F, 0, c.range_max, 3.0F, -1};
  c.no_return_value = no_return[draw.integer(0, 4)];
  c.too_close = static_cast<Sentinel>(draw.integer(0, 2));
  const float too_close[] = {0, c.range_min, 0.001F, 5.0F};
  c.too_close_value = too_close[draw.integer(0, 3)];
  laser.noise_sigma = draw.chance(0.3) ? 0 : draw.real(0, 0.1);
  laser.quantization = draw.chance(0.3) ? 0 : draw.chance(0.5) ? 0.01 : draw.real(0.0001, 0.25);
  laser.intensity_scale = draw.chance(0.3) ? 1 : draw.real(0.1, 65'535);
  return laser;
}

/// Ranges that are difficult to compare: payloads of NaN, zeros of both signs, denormals, exact limits.
float random_range(Draw& draw, const RangeConvention& c) {
  switch (draw.integer(0, 15)) {
    case 0:
      return std::bit_cast<float>(0x7F800001U | static_cast<std::uint32_t>(draw.word() & 0x803FFFFFU));
    case 1:
      return std::bit_cast<float>(0x7FC00000U | static_cast<std::uint32_t>(draw.word() & 0x803FFFFFU));
    case 2:
      return draw.chance(0.5) ? kInf : -kInf;
    case 3:
      return draw.chance(0.5) ? 0.0F : -0.0F;
    case 4:
      return std::bit_cast<float>(static_cast<std::uint32_t>(draw.word() & 0x807FFFFFU));
    case 5:
      return draw.chance(0.5) ? c.range_max : std::nextafter(c.range_max, draw.chance(0.5) ? 0.0F : kInf);
    case 6:
      return draw.chance(0.5) ? c.range_min : std::nextafter(c.range_min, draw.chance(0.5) ? -1.0F : kInf);
    case 7:
      return draw.chance(0.5) ? c.no_return_sentinel() : c.too_close_sentinel();
    case 8:
      return draw.chance(0.5) ? c.no_return_value : c.too_close_value;
    case 9:
      return std::bit_cast<float>(static_cast<std::uint32_t>(draw.word()));
    default:
      return static_cast<float>(draw.real(0, 1.1 * double{c.range_max}));
  }
}

RangeHit random_hit(Draw& draw, const RangeConvention& c, float near) {
  if (draw.chance(0.2)) return {kInf, -1, 0};
  RangeHit hit{static_cast<float>(draw.real(0, 1.1 * double{c.range_max})), draw.integer(0, 40),
               static_cast<float>(draw.real(0, 1))};
  if (draw.chance(0.2)) hit.range = near;
  if (draw.chance(0.1)) hit.range = static_cast<float>(draw.real(0, 2 * double{c.range_min}));
  if (draw.chance(0.05)) hit.range = draw.chance(0.5) ? 0 : c.range_max;
  return hit;
}

struct Case {
  LaserDescription laser;
  NoiseKey key;
  Scan real;
  std::vector<RangeHit> virtual_hits, building_hits;
};

void random_case(Draw& draw, std::size_t beams, Case& c) {
  c.laser = random_laser(draw);
  c.key = {draw.word(), draw.word()};
  c.real.stamp = {static_cast<std::int64_t>(draw.word() >> 2)};
  c.real.angle_min = static_cast<float>(draw.real(-4, 4));
  c.real.angle_increment = static_cast<float>(draw.real(-0.1, 0.1));
  c.real.ranges.resize(beams);
  c.real.intensities.resize(draw.chance(0.5) ? beams : 0);
  c.virtual_hits.resize(beams);
  c.building_hits.resize(beams);
  for (std::size_t i = 0; i < beams; ++i) {
    c.real.ranges[i] = random_range(draw, c.laser.convention);
    c.virtual_hits[i] = random_hit(draw, c.laser.convention, c.real.ranges[i]);
    c.building_hits[i] = random_hit(draw, c.laser.convention, c.virtual_hits[i].range);
    c.building_hits[i].body = -1;
  }
  for (float& intensity : c.real.intensities)
    intensity = std::bit_cast<float>(static_cast<std::uint32_t>(draw.word()));
}

/// Promise 1 clause by clause, for one beam; empty where it is kept.
std::string broken_clause(const Case& c, std::size_t i, const Scan& out, std::int32_t body) {
  const RangeConvention& convention = c.laser.convention;
  const float real = c.real.ranges[i], written = out.ranges[i];
  const RangeHit& hit = c.virtual_hits[i];
  const BeamKind kind = convention.classify(real);
  const bool intensities = !c.real.intensities.empty();
  if (body < 0) {
    if (bits(real) != bits(written)) return "a beam that is not replaced is not bit-identical";
    if (intensities && bits(out.intensities[i]) != bits(c.real.intensities[i]))
      return "its intensity changed";
  } else {
    if (body != hit.body) return "names another body";
    if (intensities &&
        out.intensities[i] != static_cast<float>(c.laser.intensity_scale * double{hit.reflectivity}))
      return "intensity is not the material's";
  }
  if (kind == BeamKind::invalid || kind == BeamKind::too_close) {
    return body < 0 ? "" : "invalid and too close must pass through";
  }
  const float measured = measure_range(c.laser, c.key, i, hit.range);
  const bool too_close =
      bits(measured) == bits(convention.too_close_sentinel()) &&
      !(convention.classify(measured) == BeamKind::hit && hit.range >= convention.range_min);
  const bool in_range = convention.classify(measured) == BeamKind::hit;
  if (body >= 0) {
    if (bits(written) != bits(measured)) return "what is written is not what the sensor would measure";
    if (hit.range < convention.range_min && bits(written) != bits(convention.too_close_sentinel())) {
      return "nearer than the minimum range, but not in the sensor's convention";
    }
    if (!too_close && !in_range) return "replaced by something that is neither hit nor too close";
    if (kind == BeamKind::hit && !too_close && !(written < real)) return "a real return is hidden";
    if (kind == BeamKind::no_return) {
      if (!(hit.range < c.building_hits[i].range)) return "behind the modelled wall";
      if (!too_close && !(written < c.building_hits[i].range)) return "behind the modelled wall as measured";
      if (!too_close && !(written < convention.range_max)) return "beyond the sensor's maximum";
    }
    return "";
  }
  // Not replaced although it should have been?
  if (hit.body < 0 || !in_range || too_close) return "";
  if (kind == BeamKind::hit && measured < real) return "nearer than the real return, but not written";
  if (kind == BeamKind::no_return && hit.range < c.building_hits[i].range &&
      measured < c.building_hits[i].range) {
    return "nearer than wall and maximum, but not written";
  }
  return "";
}

TEST(Augmentation, keeps_promise_1_over_ten_million_beams) {
  constexpr std::size_t kBeams = 1000, kScans = 10'100;
  Draw draw(20260101);
  Case c;
  Scan out;
  std::vector<std::int32_t> beam_body;
  std::size_t replaced = 0, beams = 0;
  for (std::size_t scan = 0; scan < kScans; ++scan) {
    random_case(draw, kBeams, c);
    const std::size_t count =
        augment_scan(c.real, c.laser, c.key, c.virtual_hits, c.building_hits, out, beam_body);
    ASSERT_EQ(out.stamp, c.real.stamp);
    ASSERT_EQ(out.ranges.size(), kBeams);
    ASSERT_EQ(out.intensities.size(), c.real.intensities.size());
    ASSERT_EQ(bits(out.angle_min), bits(c.real.angle_min));
    ASSERT_EQ(bits(out.angle_increment), bits(c.real.angle_increment));
    std::size_t named = 0;
    for (std::size_t i = 0; i < kBeams; ++i) {
      const std::string broken = broken_clause(c, i, out, beam_body[i]);
      ASSERT_EQ(broken, "") << "scan " << scan << " beam " << i << ": real " << c.real.ranges[i]
                            << " virtual " << c.virtual_hits[i].range << " wall " << c.building_hits[i].range
                            << " written " << out.ranges[i];
      named += beam_body[i] >= 0;
    }
    ASSERT_EQ(named, count);
    replaced += count;
    beams += kBeams;
  }
  EXPECT_GE(beams, 10'000'000U);
  EXPECT_GT(replaced, beams / 10);
  EXPECT_LT(replaced, beams / 2);
}

/// Three hand-written clauses: a laser without noise, 0.1 to 30 m, that writes 0 for too close and +inf for
/// no return.
struct ByHand {
  LaserDescription laser;
  Scan real, out;
  std::vector<RangeHit> virtual_hits, building_hits;
  std::vector<std::int32_t> beam_body;

  ByHand() {
    laser.convention = {0.1F, 30, RangeConvention::Sentinel::infinity, 0, RangeConvention::Sentinel::value,
                        0};
  }
  void beam(float real_range, float virtual_range, float wall) {
    real.ranges.push_back(real_range);
    real.intensities.push_back(100);
    virtual_hits.push_back({virtual_range, virtual_range < kInf ? 3 : -1, 0.7F});
    building_hits.push_back({wall, -1, 0});
  }
  std::size_t augment() { return augment_scan(real, laser, {}, virtual_hits, building_hits, out, beam_body); }
};

TEST(Augmentation, writes_the_nearer_of_real_and_virtual) {
  ByHand scan;
  scan.beam(5, 3, 5);
  scan.beam(5, 7, 5);
  scan.beam(5, 5, 9);
  scan.beam(5, kInf, 5);
  EXPECT_EQ(scan.augment(), 1U);
  EXPECT_EQ(scan.out.ranges, (std::vector<float>{3, 5, 5, 5}));
  EXPECT_EQ(scan.out.intensities, (std::vector<float>{0.7F, 100, 100, 100}));
  EXPECT_EQ(scan.beam_body, (std::vector<std::int32_t>{3, -1, -1, -1}));
  EXPECT_EQ(scan.real.ranges[0], 5) << "the raw scan is never touched";
}

TEST(Augmentation, only_real_returns_occlude_not_the_model) {
  ByHand scan;
  scan.beam(5, 3, 2);
  EXPECT_EQ(scan.augment(), 1U) << "the beam really came as far as 5 m, whatever the model says";
}

TEST(Augmentation, shows_nothing_behind_the_modelled_wall_where_the_beam_was_lost) {
  ByHand scan;
  scan.beam(kInf, 3, 5);
  scan.beam(kInf, 6, 5);
  scan.beam(kInf, 3, kInf);
  scan.beam(kInf, 29, kInf);
  scan.beam(kInf, 31, kInf);
  EXPECT_EQ(scan.augment(), 3U);
  EXPECT_EQ(scan.out.ranges, (std::vector<float>{3, kInf, 3, 29, kInf}));
}

TEST(Augmentation, writes_bodies_around_the_laser_as_too_close) {
  ByHand scan;
  scan.beam(5, 0, 5);
  scan.beam(5, 0.05F, 5);
  scan.beam(kInf, 0.05F, 5);
  scan.beam(0, 0.05F, 5);
  EXPECT_EQ(scan.augment(), 3U);
  EXPECT_EQ(scan.out.ranges, (std::vector<float>{0, 0, 0, 0}));
  EXPECT_EQ(scan.beam_body.back(), -1) << "what is really too close stays so";
}

TEST(Augmentation, leaves_beams_with_unknown_ranges_unchanged) {
  ByHand scan;
  scan.beam(5, 3, 5);
  scan.beam(kInf, 3, 5);
  scan.building_hits.clear();
  EXPECT_EQ(scan.augment(), 1U) << "without a wall's range a lost beam stays lost";
  scan.virtual_hits.clear();
  EXPECT_EQ(scan.augment(), 0U);
  EXPECT_EQ(scan.out.ranges, scan.real.ranges);
  EXPECT_EQ(scan.beam_body.size(), 2U);
}

TEST(Augmentation, writes_intensities_in_the_sensors_own_unit) {
  ByHand scan;
  scan.beam(5, 3, 5);
  scan.beam(5, kInf, 5);
  scan.real.intensities = {1234, 1234};
  scan.virtual_hits[0].reflectivity = 0.25F;
  scan.laser.intensity_scale = 4000;
  EXPECT_EQ(scan.augment(), 1U);
  EXPECT_EQ(scan.out.intensities, (std::vector<float>{1000, 1234}));
}

TEST(Simulation, writes_the_nearest_of_bodies_and_building) {
  ByHand scan;
  scan.beam(0, 3, 5);
  scan.beam(0, 6, 5);
  scan.beam(0, kInf, kInf);
  scan.laser.angle_min = -0.5;
  scan.laser.angle_increment = 0.25;
  simulate_scan(scan.laser, {}, scan.virtual_hits, scan.building_hits, {77}, scan.out);
  EXPECT_EQ(scan.out.ranges, (std::vector<float>{3, 5, kInf}));
  EXPECT_EQ(scan.out.stamp.ns, 77);
  EXPECT_EQ(scan.out.angle_min, -0.5F);
  EXPECT_EQ(scan.out.angle_increment, 0.25F);
  EXPECT_TRUE(scan.out.intensities.empty());
}

// Reference: the output of augment_scan for a scan without returns.
TEST(Simulation, writes_the_intensities_that_augmentation_writes) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    Draw draw(seed);
    LaserDescription laser = random_laser(draw);
    laser.intensities = true;
    laser.convention.no_return = RangeConvention::Sentinel::infinity;
    std::vector<RangeHit> bodies(50), building(50, {kInf, -1, 0}), nearest(50);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const auto hit = [&](int body) {
        return draw.chance(0.3) ? RangeHit{kInf, -1, 0}
                                : RangeHit{static_cast<float>(draw.real(0, 120)), body,
                                           static_cast<float>(draw.real(0, 1))};
      };
      bodies[i] = hit(3);
      building[i] = hit(-1);
      nearest[i] = bodies[i].range <= building[i].range ? bodies[i] : building[i];
      if (nearest[i].range < kInf) nearest[i].body = 0;
    }
    Scan simulated;
    simulate_scan(laser, {seed, 1}, bodies, building, {}, simulated);
    Scan empty, augmented;
    empty.ranges.assign(50, laser.convention.no_return_sentinel());
    empty.intensities.assign(50, 0);
    std::vector<std::int32_t> beam_body;
    const std::vector<RangeHit> open(50, {kInf, -1, 0});
    augment_scan(empty, laser, {seed, 1}, nearest, open, augmented, beam_body);
    ASSERT_EQ(simulated.intensities, augmented.intensities) << "seed " << seed;
    for (std::size_t i = 0; i < 50; ++i)
      ASSERT_TRUE(simulated.ranges[i] == augmented.ranges[i] || std::isnan(simulated.ranges[i])) << i;
  }
}

}  // namespace
}  // namespace parhelion::scan
