// Score of a semantic net on a known building, label by label.
#pragma once

#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "fusion/semantic/net/semantic_net.hpp"
#include "tests/long_run.hpp"
#include "tests/random_site.hpp"

namespace parhelion::test {

/// Counts of correct detections, of all detections, and of all true items.
struct Rate {
  double both = 0, found = 0, there = 0;
  double precision() const { return found > 0 ? both / found : 1; }
  double recall() const { return there > 0 ? both / there : 1; }
  Rate& operator+=(const Rate& o) {
    both += o.both, found += o.found, there += o.there;
    return *this;
  }
};

struct SiteScore {
  Rate wall, floor, ceiling, pillar_points, stairs;  ///< points
  Rate wall_drawn;                                   ///< 0.1 m pieces of the walls drawn; precision only
  Rate wall_seen;                     ///< 0.1 m pieces of walls that were measured; recall only
  Rate door, window, pillar, flight;  ///< entities
  Rate step;                          ///< rises within 1 cm, in order from the lowest
  std::array<Rate, 5> door_kind;      ///< recall only, by DoorKind

  SiteScore& operator+=(const SiteScore& o) {
    wall += o.wall, floor += o.floor, ceiling += o.ceiling, pillar_points += o.pillar_points;
    stairs += o.stairs, wall_drawn += o.wall_drawn, wall_seen += o.wall_seen, door += o.door,
        window += o.window;
    pillar += o.pillar, flight += o.flight, step += o.step;
    for (std::size_t k = 0; k < door_kind.size(); ++k) door_kind[k] += o.door_kind[k];
    return *this;
  }
  void print() const {
    const auto line = [](const char* name, const Rate& r) {
      std::printf("  %-16s precision %.3f  recall %.3f  (%.0f of %.0f found, %.0f there)\n", name,
                  r.precision(), r.recall(), r.both, r.found, r.there);
    };
    line("wall points", wall), line("floor points", floor), line("ceiling points", ceiling);
    line("pillar points", pillar_points), line("stairs points", stairs);
    std::printf("  wall, 0.1 m      precision %.3f of %.0f drawn  recall %.3f of %.0f seen\n",
                wall_drawn.precision(), wall_drawn.found, wall_seen.recall(), wall_seen.there);
    line("door", door), line("window", window);
    line("pillar", pillar), line("flight", flight), line("step", step);
    constexpr std::array<const char*, 5> names = {"open", "leaf open", "recessed", "flush", "ajar"};
    for (std::size_t k = 0; k < names.size(); ++k)
      std::printf("  door %-10s recall %.3f of %.0f\n", names[k], door_kind[k].recall(), door_kind[k].there);
  }
};

/// A random building, scanned by a scanner of random kind, and levelled.
struct LevelledSite {
  RandomSite site;
  ScannedSite scanned;
  cloud::PointCloud<Map> cloud;
  Transform<Map, Map> T_site_map;
};

inline LevelledSite levelled_site(std::uint64_t seed) {
  LevelledSite result;
  result.site = SiteBuilder(seed).build();
  std::mt19937_64 random(seed * 7919 + 5);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1.0p-53;
  };
  ScanOptions options;
  options.noise = uniform(0.002, 0.010);
  options.step = uniform(long_run() ? 0.010 : 0.014, 0.022);  // finer ones cost time and change little
  options.tilt = uniform(0, 0.03);
  options.yaw = uniform(-3, 3);
  options.viewpoints = uniform(0, 1) < 0.8;
  result.scanned = scan(result.site, options, seed + 1);
  const auto T_map_cloud = semantic::level(result.scanned.cloud);
  if (!T_map_cloud) throw std::runtime_error(T_map_cloud.error().message);
  result.cloud = cloud::transformed(*T_map_cloud, result.scanned.cloud);
  result.T_site_map = (*T_map_cloud * result.scanned.T_cloud_site).inverse();
  return result;
}

namespace site_score {

inline void score_points(const cloud::PointCloud<Cloud>& truth, const std::vector<std::uint8_t>& labels,
                         SiteScore& score) {
  const auto count = [&](EntityLabel label, Rate& rate) {
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const auto is = static_cast<EntityLabel>(truth.labels[i]);
      auto predicted = static_cast<EntityLabel>(labels[i]);
      if (is == kNotScored) continue;
      if (predicted == EntityLabel::wall_above_door) predicted = EntityLabel::wall;
      rate.both += is == label && predicted == label;
      rate.found += predicted == label;
      rate.there += is == label;
    }
  };
  count(EntityLabel::wall, score.wall), count(EntityLabel::floor, score.floor);
  count(EntityLabel::ceiling, score.ceiling), count(EntityLabel::pillar, score.pillar_points);
  count(EntityLabel::stairs, score.stairs);
}

/// m in the plan from a point to a box's footprint.
inline double distance(const ModelEntity& box, const Eigen::Vector3d& p) {
  const Eigen::Vector3d local = box.T_map_body.inverse() * p;
  const Eigen::Vector2d outside = local.head<2>().cwiseAbs() - 0.5 * box.size.head<2>();
  return outside.cwiseMax(0).norm();
}

constexpr double kNear = 0.12;  ///< m, of a drawn wall to a true one

inline bool is_wall(const ModelEntity& e) { return e.label == EntityLabel::wall; }

/// Which pieces of the detected walls lie on a true wall.
inline void score_drawn_walls(const RandomSite& site, const Transform<Map, Map>& T_site_map,
                              const std::vector<ModelEntity>& found, SiteScore& score) {
  const std::vector<ModelEntity>& boxes = site.model.entities;
  for (const ModelEntity& e : found) {
    if (!is_wall(e)) continue;
    for (double s = -e.size.x() / 2 + 0.05; s < e.size.x() / 2; s += 0.1) {
      const Eigen::Vector3d p = T_site_map * (e.T_map_body * Eigen::Vector3d(s, 0, 0));
      score.wall_drawn.found += 1;
      score.wall_drawn.both += std::any_of(boxes.begin(), boxes.end(), [&](const ModelEntity& box) {
        return is_wall(box) && distance(box, p) < kNear;
      });
    }
  }
}

/// How many of `points` (m, site frame) lie on each 0.1 m of a wall's box along its `axis`.
inline std::vector<int> measured_pieces(const std::vector<Eigen::Vector3d>& points, const ModelEntity& box,
                                        int axis) {
  constexpr double kOnIt = 0.03;  // m
  std::vector<int> counts(static_cast<std::size_t>(std::floor(box.size[axis] / 0.1)));
  for (const Eigen::Vector3d& p : points) {
    if (distance(box, p) > kOnIt) continue;
    const double along = (box.T_map_body.inverse() * p)[axis] + box.size[axis] / 2;
    const auto piece = static_cast<std::ptrdiff_t>(std::floor(along / 0.1));
    if (piece >= 0 && piece < std::ssize(counts)) ++counts[static_cast<std::size_t>(piece)];
  }
  return counts;
}

/// Which pieces of true walls, of those measured by more than a few points, have a detected wall.
inline void score_seen_walls(const LevelledSite& levelled, const std::vector<ModelEntity>& found,
                             SiteScore& score) {
  constexpr int kFew = 30;
  const Transform<Map, Map> T_map_site = levelled.T_site_map.inverse();
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < levelled.cloud.size(); ++i) {
    if (static_cast<EntityLabel>(levelled.scanned.cloud.labels[i]) == EntityLabel::wall)
      points.emplace_back(levelled.T_site_map * levelled.cloud.points[i].cast<double>());
  }
  for (const ModelEntity& box : levelled.site.model.entities) {
    if (!is_wall(box) || box.size.z() < levelled.site.height - 0.01) continue;
    const int axis = box.size.x() > box.size.y() ? 0 : 1;
    const std::vector<int> counts = measured_pieces(points, box, axis);
    for (std::size_t k = 0; k < counts.size(); ++k) {
      if (counts[k] < kFew) continue;
      Eigen::Vector3d p(0, 0, 0);
      p[axis] = (static_cast<double>(k) + 0.5) * 0.1 - box.size[axis] / 2;
      const Eigen::Vector3d in_map = T_map_site * (box.T_map_body * p);
      score.wall_seen.there += 1;
      score.wall_seen.both += std::any_of(found.begin(), found.end(), [&](const ModelEntity& e) {
        return is_wall(e) && distance(e, in_map) < kNear;
      });
    }
  }
}

/// The opening of a door or a window: a door that is open is turned to its closed angle.
inline Eigen::Vector2d opening_centre(const ModelEntity& e) {
  Eigen::Vector2d in_door(0, 0);
  if (e.hinge)
    in_door = e.hinge->axis - Eigen::Rotation2Dd(e.hinge->closed).toRotationMatrix() * e.hinge->axis;
  return (e.T_map_body * Eigen::Vector3d(in_door.x(), in_door.y(), 0)).head<2>();
}

inline void score_openings(const RandomSite& site, const Transform<Map, Map>& T_site_map,
                           const std::vector<ModelEntity>& found, SiteScore& score) {
  constexpr double kFrom = 0.35, kWidth = 0.3;  // m
  std::vector<bool> matched(site.openings.size(), false);
  for (const ModelEntity& e : found) {
    if (e.label != EntityLabel::door && e.label != EntityLabel::window) continue;
    const bool window = e.label == EntityLabel::window;
    const Eigen::Vector2d in_map = opening_centre(e);
    const Eigen::Vector2d p = (T_site_map * Eigen::Vector3d(in_map.x(), in_map.y(), 0)).head<2>();
    Rate& rate = window ? score.window : score.door;
    rate.found += 1;
    for (std::size_t o = 0; o < site.openings.size(); ++o) {
      const TrueOpening& opening = site.openings[o];
      if (matched[o] || opening.window != window || (opening.centre - p).norm() > kFrom ||
          std::abs(opening.width - e.size.x()) > kWidth)
        continue;
      matched[o] = true;
      rate.both += 1;
      break;
    }
  }
  for (std::size_t o = 0; o < site.openings.size(); ++o) {
    const TrueOpening& opening = site.openings[o];
    (opening.window ? score.window : score.door).there += 1;
    if (opening.window) continue;
    Rate& kind = score.door_kind[static_cast<std::size_t>(opening.kind)];
    kind.there += 1, kind.both += matched[o];
  }
}

inline void score_pillars(const RandomSite& site, const Transform<Map, Map>& T_site_map,
                          const std::vector<ModelEntity>& found, SiteScore& score) {
  const auto is_pillar = [](const ModelEntity& e) { return e.label == EntityLabel::pillar; };
  for (const ModelEntity& e : found) {
    if (!is_pillar(e)) continue;
    const Eigen::Vector3d p = T_site_map * e.T_map_body.translation();
    score.pillar.found += 1;
    score.pillar.both +=
        std::any_of(site.model.entities.begin(), site.model.entities.end(), [&](const ModelEntity& box) {
          return is_pillar(box) && (box.T_map_body.translation() - p).head<2>().norm() < 0.25;
        });
  }
  score.pillar.there +=
      static_cast<double>(std::count_if(site.model.entities.begin(), site.model.entities.end(), is_pillar));
}

/// How many of a flight's treads, from the lowest, were measured by more than a few points.
inline std::size_t seen_treads(const LevelledSite& levelled, const std::vector<double>& rises) {
  constexpr int kFew = 30;
  double top = 0;
  for (std::size_t i = 0; i < rises.size(); ++i) {
    top += rises[i];
    int points = 0;
    for (std::size_t k = 0; k < levelled.cloud.size(); ++k) {
      const auto label = static_cast<EntityLabel>(levelled.scanned.cloud.labels[k]);
      if (label != EntityLabel::stairs && label != kNotScored) continue;
      const Eigen::Vector3d p = levelled.T_site_map * levelled.cloud.points[k].cast<double>();
      points += std::abs(p.z() - top) < 0.03;
    }
    if (points < kFew) return i;
  }
  return rises.size();
}

inline void score_stairs(const LevelledSite& levelled, const std::vector<semantic::StairsFlight>& found,
                         SiteScore& score) {
  score.flight.found += static_cast<double>(found.size());
  for (const semantic::StairsFlight& flight : found)
    score.step.found += static_cast<double>(flight.rises.size());
  for (std::vector<double> rises : levelled.site.flights) {
    const std::size_t seen = seen_treads(levelled, rises);
    double best_match = 0;
    for (const semantic::StairsFlight& flight : found) {
      double same = 0;
      for (std::size_t i = 0; i < std::min(rises.size(), flight.rises.size()); ++i)
        same += std::abs(rises[i] - flight.rises[i]) < 0.01;
      best_match = std::max(best_match, same);
    }
    score.step.there += static_cast<double>(std::max(seen, static_cast<std::size_t>(best_match)));
    score.step.both += best_match;
    score.flight.there += seen >= 3 || best_match >= 3;
    score.flight.both += best_match >= 3 && best_match >= static_cast<double>(seen);
  }
}

}  // namespace site_score

inline SiteScore score_site(const LevelledSite& levelled, const semantic::SemanticNet& net) {
  SiteScore score;
  site_score::score_points(levelled.scanned.cloud, net.labels, score);
  site_score::score_drawn_walls(levelled.site, levelled.T_site_map, net.entities, score);
  site_score::score_seen_walls(levelled, net.entities, score);
  site_score::score_openings(levelled.site, levelled.T_site_map, net.entities, score);
  site_score::score_pillars(levelled.site, levelled.T_site_map, net.entities, score);
  site_score::score_stairs(levelled, net.stairs, score);
  return score;
}

/// Segments and labels the scans of a random building.
inline SiteScore score_random_site(std::uint64_t seed) {
  const LevelledSite levelled = levelled_site(seed);
  const auto surfaces = semantic::segment(levelled.cloud);
  if (!surfaces) throw std::runtime_error(surfaces.error().message);
  const auto net = semantic::label_entities(levelled.cloud, *surfaces);
  if (!net) throw std::runtime_error(net.error().message);
  return score_site(levelled, *net);
}

}  // namespace parhelion::test
