// Sites drawn at random to be hard: what a semantic model meets that was never looked at. Walls, furniture
// with its kind, flights, ramps and kerbs are known.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "protocols/model.hpp"
#include "tests/model_box.hpp"

namespace parhelion::test {

enum class SiteKind : std::uint8_t {
  flat,
  stair_hall,
  storeys,
  yard,
  office,
  apartment,  ///< rooms full of furniture and clutter; curtains, glass, a mirror, somebody walks about
  big_steps,  ///< a wide flight outdoors, seen from its foot and its side only
  two_plans,  ///< two storeys whose walls stand in different places
  ramps,      ///< a hall with a raised part, a ramp and steps up to it, a wedge before a door's sill
  askew,      ///< a flight beside a wall that runs in another direction
  attic,      ///< this and the following: kinds/kinds.hpp
  bulkheads,
  car_park,
  carriage,
  container_yard,
  cubicles,
  mirror_hall,
  rubble,
  split_level,
  stage,
  tunnel,
  walkers
};
inline constexpr int kSiteKinds = 10;     ///< those that objects were trained on and most figures are of
inline constexpr int kAllSiteKinds = 22;  ///< with the further ones

inline const char* to_string(SiteKind kind) {
  constexpr const char* names[] = {"flat",      "stair hall",  "storeys",   "yard",        "office",
                                   "apartment", "big steps",   "two plans", "ramps",       "askew",
                                   "attic",     "bulkheads",   "car park",  "carriage",    "containers",
                                   "cubicles",  "mirror hall", "rubble",    "split level", "stage",
                                   "tunnel",    "walkers"};
  return names[static_cast<std::size_t>(kind)];
}

/// Some boxes that are one thing: a table's top and its legs.
struct TrueObject {
  std::string kind;  ///< "table", "chair", ...; "thing": any
  std::vector<std::size_t> boxes;
};

struct TrueFlight {
  std::vector<double> rises;  ///< m, from the lowest
  std::vector<Eigen::AlignedBox3d> treads;
};

struct TrueDoor {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< m
  double width = 0;                                  ///< m
  double floor = 0;                                  ///< m
  Eigen::Vector2d along = Eigen::Vector2d::UnitX();  ///< unit, its wall
};

/// The straight edge of a low step between two grounds.
struct TrueKerb {
  Eigen::Vector2d from = Eigen::Vector2d::Zero(), to = Eigen::Vector2d::Zero();  ///< m
  double low = 0, high = 0;  ///< m, heights of the grounds
};

struct MeanSite {
  SiteKind kind = SiteKind::flat;
  SemanticModel model;  ///< boxes in the site's frame; labels say what each is
  std::vector<TrueObject> objects;
  std::vector<TrueFlight> flights;
  std::vector<TrueDoor> doors;
  std::vector<TrueKerb> kerbs;
  std::vector<Eigen::Vector3d> scanners;
  std::vector<Eigen::Vector3d> path;  ///< where a camera is carried, m
  std::vector<std::size_t> ramps;     ///< boxes; x goes uphill, the upper side is the ramp
  std::vector<std::size_t> glass;     ///< boxes that return one ray of eight
  std::vector<std::size_t> mirrors;   ///< boxes that reflect
  /// Where somebody walks while a scanner turns: to and fro between two places on the floor, m.
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> walkers;
  bool ceiling = true;
};

/// Of boxes that may be called one thing or another.
inline constexpr EntityLabel kNotJudged = EntityLabel::window;

/// Draws pieces; its own arithmetic on the generator's words, so that every library draws the same.
class SitePen {
 public:
  /// `varied`: things of one kind differ in their proportions and parts, and there are more outdoors.
  explicit SitePen(std::uint64_t seed, bool varied = false)
      : random_(seed), postures_(~seed), shapes_(seed + 77), varied_(varied) {}
  MeanSite& site() { return site_; }

  double uniform() { return static_cast<double>(random_() >> 11) * 0x1.0p-53; }
  double range(double low, double high) { return low + (high - low) * uniform(); }
  int whole(int low, int high) { return low + static_cast<int>(uniform() * (high - low + 1)); }
  bool chance(double p) { return uniform() < p; }
  bool varied() const { return varied_; }
  /// Of a thing's shape: `usual` unless things are varied.
  double shape(double low, double high, double usual) {
    return varied_ ? low + (high - low) * static_cast<double>(shapes_() >> 11) * 0x1.0p-53 : usual;
  }

  std::size_t box(EntityLabel label, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    auto& boxes = site_.model.entities;
    boxes.push_back(model_box("box " + std::to_string(boxes.size()), label, 0.5 * (low + high), high - low));
    return boxes.size() - 1;
  }

  /// Along x or y from `a` to `b`, its middle on the line between them.
  void wall(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double z0, double z1, double thick = 0.12) {
    const Eigen::Vector2d low = a.cwiseMin(b), high = a.cwiseMax(b);
    const bool along_x = high.x() - low.x() > high.y() - low.y();
    const Eigen::Vector2d half = along_x ? Eigen::Vector2d(0, thick / 2) : Eigen::Vector2d(thick / 2, 0);
    if ((high - low).maxCoeff() < 0.01) return;
    const Eigen::Vector2d p = low - half, q = high + half;
    box(EntityLabel::wall, {p.x(), p.y(), z0}, {q.x(), q.y(), z1});
  }

  /// The same with a doorway `at` m from `a`; its leaf may stand open beyond it.
  void wall_with_door(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double z0, double z1, double at,
                      double width, double thick = 0.12) {
    const Eigen::Vector2d d = (b - a).normalized();
    const Eigen::Vector2d p = a + at * d, q = a + (at + width) * d;
    wall(a, p, z0, z1, thick);
    wall(q, b, z0, z1, thick);
    wall(p, q, z0 + 2.05, z1, thick);
    site_.doors.push_back({0.5 * (p + q), width, z0, d});
  }

  /// A thing of boxes given relative to `at`, turned by quarter turns.
  struct Part {
    Eigen::Vector3d low, high;
  };
  void thing(const std::string& kind, const Eigen::Vector3d& at, int quarter,
             const std::vector<Part>& parts) {
    TrueObject object;
    object.kind = kind;
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(quarter * EIGEN_PI / 2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const bool person = kind.ends_with("person");
    Eigen::Vector3d scale;
    for (double& s : scale) s = person ? shape(0.92, 1.08, 1) : shape(0.85, 1.2, 1);
    for (const Part& part : parts) {
      const Eigen::Vector3d a = at + turn * part.low.cwiseProduct(scale),
                            b = at + turn * part.high.cwiseProduct(scale);
      object.boxes.push_back(box(EntityLabel::unknown, a.cwiseMin(b), a.cwiseMax(b)));
    }
    site_.objects.push_back(object);
  }

  /// `along` x `deep` m, its top at `high`.
  void table(const Eigen::Vector3d& at, int quarter, double along, double deep, double high) {
    std::vector<Part> parts = {{{-along / 2, -deep / 2, high - 0.03}, {along / 2, deep / 2, high}}};
    const double style = shape(0, 1, 0);
    if (style > 0.85) {  // on a column
      parts.push_back({{-0.05, -0.05, 0.04}, {0.05, 0.05, high - 0.03}});
      parts.push_back({{-0.3, -0.3, 0}, {0.3, 0.3, 0.04}});
      return thing("table", at, quarter, parts);
    }
    if (style > 0.65)  // with drawers
      parts.push_back(
          {{along / 2 - 0.45, -deep / 2 + 0.05, 0.05}, {along / 2 - 0.05, deep / 2 - 0.05, high - 0.03}});
    for (const double x : {-along / 2 + 0.03, along / 2 - 0.08}) {
      for (const double y : {-deep / 2 + 0.03, deep / 2 - 0.08})
        parts.push_back({{x, y, 0}, {x + 0.05, y + 0.05, high - 0.03}});
    }
    thing("table", at, quarter, parts);
  }
  void chair(const Eigen::Vector3d& at, int quarter) {
    const double half = shape(0.18, 0.27, 0.22), seat = shape(0.38, 0.5, 0.42), back = shape(0.7, 1.1, 0.9),
                 style = shape(0, 1, 0);
    std::vector<Part> parts = {{{-half, -half, seat}, {half, half, seat + 0.04}}};
    if (style < 0.9) parts.push_back({{-half, half - 0.04, seat + 0.04}, {half, half, back}});
    if (style > 0.45 && style < 0.9) {  // arms
      for (const double x : {-half - 0.03, half - 0.02})
        parts.push_back({{x, -half + 0.05, seat + 0.18}, {x + 0.05, half, seat + 0.22}});
    }
    if (style > 0.35 && style < 0.7) {  // turns on a column with a star of feet
      parts.push_back({{-0.03, -0.03, 0.08}, {0.03, 0.03, seat}});
      parts.push_back({{-half, -0.03, 0}, {half, 0.03, 0.08}});
      parts.push_back({{-0.03, -half, 0}, {0.03, half, 0.08}});
      return thing("chair", at, quarter, parts);
    }
    for (const double x : {-half + 0.02, half - 0.06}) {
      for (const double y : {-half + 0.02, half - 0.06})
        parts.push_back({{x, y, 0}, {x + 0.04, y + 0.04, seat}});
    }
    thing("chair", at, quarter, parts);
  }
  void sofa(const Eigen::Vector3d& at, int quarter, double along) {
    const double l = along / 2, seat = shape(0.36, 0.48, 0.42), back = shape(0.65, 0.95, 0.85),
                 arm = shape(0.5, 0.7, 0.62), style = shape(0, 1, 0);
    std::vector<Part> parts = {{{-l, -0.42, style > 0.7 ? 0.12 : 0}, {l, 0.2, seat}},
                               {{-l, 0.2, 0}, {l, 0.42, back}}};
    if (style < 0.8) parts.push_back({{-l, -0.42, seat}, {-l + 0.18, 0.2, arm}});
    if (style < 0.6) parts.push_back({{l - 0.18, -0.42, seat}, {l, 0.2, arm}});
    thing("sofa", at, quarter, parts);
  }
  void bed(const Eigen::Vector3d& at, int quarter) {
    const double w = range(0.45, 0.9), high = range(0.4, 0.6);
    thing("bed", at, quarter,
          {{{-w, -1.0, 0.15}, {w, 1.0, high}}, {{-w, 1.0, 0}, {w, 1.06, high + range(0.2, 0.5)}}});
  }
  /// From `foot`, the middle of its lower edge, uphill towards `yaw` (rad), up to `rise` over it; `thick` m.
  void ramp(const Eigen::Vector3d& foot, double yaw, double slope, double rise, double wide, double thick) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(-slope, Eigen::Vector3d::UnitY()));
    const double length = rise / std::sin(slope);
    ModelEntity box = model_box("ramp", EntityLabel::unknown, {0, 0, 0}, {length, wide, thick});
    box.T_map_body = Transform<Map, Body>(turn, foot + turn * Eigen::Vector3d(length / 2, 0, -thick / 2));
    site_.ramps.push_back(site_.model.entities.size());
    site_.model.entities.push_back(box);
  }
  /// Solid: cupboard, counter, bin, box.
  void solid(const std::string& kind, const Eigen::Vector3d& at, int quarter, const Eigen::Vector3d& size) {
    thing(kind, at, quarter, {{{-size.x() / 2, -size.y() / 2, 0}, {size.x() / 2, size.y() / 2, size.z()}}});
  }
  void shelf(const Eigen::Vector3d& at, int quarter, double along, double high) {
    const double l = along / 2, deep = shape(0.1, 0.22, 0.15), each = shape(0.28, 0.45, 0.36);
    std::vector<Part> parts = {{{-l, -deep, 0}, {-l + 0.02, deep, high}},
                               {{l - 0.02, -deep, 0}, {l, deep, high}}};
    if (shape(0, 1, 1) < 0.4) parts.push_back({{-l, deep - 0.01, 0}, {l, deep, high}});  // a back
    for (double z = 0.08; z < high; z += each) {
      parts.push_back({{-l, -deep, z}, {l, deep, z + 0.02}});
      if (z + 0.3 < high)
        parts.push_back({{-l + 0.1, -0.1, z + 0.02}, {range(-0.2, l - 0.1), deep, z + 0.25}});
    }
    thing("shelf", at, quarter, parts);
  }
  void plant(const Eigen::Vector3d& at) {
    std::vector<Part> parts = {{{-0.15, -0.15, 0}, {0.15, 0.15, 0.3}}};
    for (int k = 0; k < 26; ++k) {
      const Eigen::Vector3d leaf(range(-0.3, 0.3), range(-0.3, 0.3), range(0.4, 1.4));
      parts.push_back(
          {leaf, leaf + Eigen::Vector3d(range(0.03, 0.14), range(0.03, 0.14), range(0.02, 0.12))});
    }
    thing("plant", at, 0, parts);
  }
  /// A bush, its foliage down to the ground.
  void bush(const Eigen::Vector3d& at, double wide, double high) {
    std::vector<Part> parts;
    for (int k = 0; k < 60; ++k) {
      const Eigen::Vector3d leaf(shape(-wide, wide, 0) / 2, shape(-wide, wide, 0) / 2, shape(0, high, 0));
      parts.push_back(
          {leaf, leaf + Eigen::Vector3d(shape(0.03, 0.2, 0), shape(0.03, 0.2, 0), shape(0.02, 0.15, 0))});
    }
    thing("plant", at, 0, parts);
  }
  /// In one of the postures, all equally often; lying along x. Drawn by a generator of its own, so that the
  /// rest of a seed's site does not depend on it.
  void person(const Eigen::Vector3d& at, int quarter) {
    switch (postures_() % 4) {
      case 0:
        return thing("standing person", at, quarter,
                     {{{-0.18, -0.1, 0}, {-0.03, 0.1, 0.85}},
                      {{0.03, -0.1, 0}, {0.18, 0.1, 0.85}},
                      {{-0.24, -0.13, 0.85}, {0.24, 0.13, 1.45}},
                      {{-0.09, -0.1, 1.45}, {0.09, 0.1, 1.75}}});
      case 1:  // on a stool
        return thing("sitting person", at, quarter,
                     {{{-0.2, -0.2, 0}, {0.2, 0.2, 0.45}},
                      {{-0.18, -0.4, 0.45}, {0.18, 0.2, 0.6}},
                      {{-0.17, -0.5, 0}, {-0.04, -0.38, 0.6}},
                      {{0.04, -0.5, 0}, {0.17, -0.38, 0.6}},
                      {{-0.24, -0.05, 0.6}, {0.24, 0.2, 1.08}},
                      {{-0.09, -0.05, 1.08}, {0.09, 0.15, 1.34}}});
      case 2:  // on the floor, legs stretched out
        return thing("sitting person", at, quarter,
                     {{{-0.18, -0.85, 0}, {-0.03, 0, 0.16}},
                      {{0.03, -0.85, 0}, {0.18, 0, 0.16}},
                      {{-0.24, 0, 0}, {0.24, 0.26, 0.62}},
                      {{-0.09, 0.02, 0.62}, {0.09, 0.22, 0.9}}});
      default:
        return thing("lying person", at, 0,
                     {{{-0.88, -0.18, 0}, {-0.03, -0.03, 0.14}},
                      {{-0.88, 0.03, 0}, {-0.03, 0.18, 0.14}},
                      {{-0.03, -0.24, 0}, {0.57, 0.24, 0.23}},
                      {{0.61, -0.09, 0}, {0.87, 0.09, 0.22}}});
    }
  }

  /// Steps along +x (or turned) from `at`, each a box down to `under`; 0: solid to the ground.
  double flight(const Eigen::Vector3d& at, int quarter, int steps, double rise, double tread, double wide,
                bool open) {
    TrueFlight flight;
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(quarter * EIGEN_PI / 2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    double z = 0;
    for (int i = 0; i < steps; ++i) {
      flight.rises.push_back(rise + range(-0.003, 0.003));
      z += flight.rises.back();
      const Eigen::Vector3d low(i * tread, -wide / 2, open ? std::max(0.0, z - rise - 0.15) : 0);
      const Eigen::Vector3d high((i + 1) * tread, wide / 2, z);
      const Eigen::Vector3d a = at + turn * low, b = at + turn * high;
      const Eigen::AlignedBox3d step(a.cwiseMin(b), a.cwiseMax(b));
      box(EntityLabel::stairs, step.min(), step.max());
      flight.treads.push_back(step);
    }
    site_.flights.push_back(flight);
    return z;
  }

  /// A box turned by any angle about the vertical; its foot at `at`.
  std::size_t turned(const Eigen::Vector3d& at, double yaw, const Eigen::Vector3d& size) {
    const std::size_t b = box(EntityLabel::unknown, at, at + size);
    site_.model.entities[b].T_map_body =
        Transform<Map, Body>::planar(at.x(), at.y(), yaw, at.z() + size.z() / 2);
    return b;
  }
  /// Something of two to five boxes at odd angles, up to `large` m.
  void oddment(const Eigen::Vector3d& at, double large) {
    TrueObject object;
    object.kind = "thing";
    double z = at.z();
    for (int k = whole(2, 5); k > 0; --k) {
      const Eigen::Vector3d size(range(0.2, 1) * large, range(0.2, 1) * large, range(0.1, 0.6) * large);
      object.boxes.push_back(turned({at.x(), at.y(), z}, range(-3, 3), size));
      z += size.z();
    }
    site_.objects.push_back(object);
  }
  /// Folds that hang from `z1` down to `z0`, along x from `a`.
  void curtain(const Eigen::Vector2d& a, double along, double z0, double z1) {
    std::vector<Part> parts;
    for (double x = 0; x < along; x += 0.12) {
      const double y = range(-0.04, 0.04);
      parts.push_back({{x, y, z0}, {x + 0.12, y + 0.03, z1}});
    }
    thing("thing", {a.x(), a.y(), 0}, 0, parts);
  }

  void stand(const Eigen::Vector3d& p) { site_.scanners.push_back(p); }

 private:
  std::mt19937_64 random_, postures_, shapes_;
  bool varied_;
  MeanSite site_;
};

/// The site of a kind and a seed; `varied`: with things of other shapes than usual.
MeanSite mean_site(SiteKind kind, std::uint64_t seed, bool varied = false);

}  // namespace parhelion::test
