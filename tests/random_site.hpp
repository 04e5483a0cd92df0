// Buildings drawn at random: rooms in rows along a corridor, a hall with a flight of stairs, doorways of all
// kinds, windows, pillars, furniture; and what 3D scanners that stood in them would have measured.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/scan/building_tree.hpp"
#include "tests/synthetic_site.hpp"

namespace parhelion::test {

/// Of boxes that may be called one thing or another; no glass stands in these windows.
constexpr EntityLabel kNotScored = EntityLabel::window;

enum class DoorKind : std::uint8_t { open, leaf_open, recessed, flush, ajar };

struct TrueOpening {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< m, site frame, middle of the wall
  double width = 0, sill = 0, head = 0;              ///< m
  double thickness = 0;                              ///< m, of the wall
  bool window = false;
  DoorKind kind = DoorKind::open;
};

struct RandomSite {
  SemanticModel model;  ///< of boxes; labels say what each point is
  std::vector<TrueOpening> openings;
  std::vector<std::vector<double>> flights;  ///< m, rises
  std::vector<Eigen::Vector3d> scanners;
  double height = 0;  ///< m, of the rooms
};

/// Draws them; its own arithmetic on the generator's words, so that every library draws the same.
class SiteBuilder {
 public:
  explicit SiteBuilder(std::uint64_t seed) : random_(seed) {}

  RandomSite build() {
    height_ = range(2.4, 3.1);
    thick_ = range(0.08, 0.2);
    const double width = range(1.7, 2.6);
    const double south = row(-thick_, -1), north = chance(0.7) ? row(width + thick_, 1) : 0;
    length_ = std::max({south, north, 5.0});
    side_wall(-thick_ / 2, doors_[0], south);
    side_wall(width + thick_ / 2, doors_[1], north);
    end_wall(-thick_ / 2, 0, width);
    const double corridor = length_;
    stand({range(0.8, 1.6), width * range(0.3, 0.7)});
    hall(width);
    if (corridor > 7) stand({corridor - range(1.0, 2.0), width * range(0.3, 0.7)});
    if (chance(0.4)) pillar({length_ * range(0.4, 0.6), 0.3});
    slabs();
    site_.height = height_;
    return std::move(site_);
  }

 private:
  struct Hole {
    double from = 0, width = 0, sill = 0, head = 0;
    bool window = false;
    DoorKind kind = DoorKind::open;
  };

  double uniform() { return static_cast<double>(random_() >> 11) * 0x1.0p-53; }
  double range(double low, double high) { return low + (high - low) * uniform(); }
  int whole(int low, int high) { return low + static_cast<int>(uniform() * (high - low + 1)); }
  bool chance(double p) { return uniform() < p; }

  void box(EntityLabel label, const Eigen::Vector3d& low, const Eigen::Vector3d& high, double yaw = 0) {
    if (((high - low).array() < 1e-3).any()) return;
    site_.model.entities.push_back(model_box("box " + std::to_string(site_.model.entities.size()), label,
                                             0.5 * (low + high), high - low, yaw));
    if (label != EntityLabel::unknown) extent_.extend(low), extent_.extend(high);
  }

  /// A wall along x (or y where `turned`) at `across`, from `from` to `to`, with holes in order.
  void wall(double across, double from, double to, bool turned, const std::vector<Hole>& holes,
            double top = 0) {
    const double t = thick_ / 2, h = top > 0 ? top : height_;
    const auto piece = [&](EntityLabel label, double a, double b, double low, double high, double near,
                           double far) {
      turned ? box(label, {across + near, a, low}, {across + far, b, high})
             : box(label, {a, across + near, low}, {b, across + far, high});
    };
    double at = from;
    for (const Hole& hole : holes) {
      const double end = hole.from + hole.width;
      piece(EntityLabel::wall, at, hole.from, 0, h, -t, t);
      piece(EntityLabel::wall, hole.from, end, 0, hole.sill, -t, t);
      piece(EntityLabel::wall, hole.from, end, hole.head, h, -t, t);
      leaf(hole, across, turned, piece);
      TrueOpening opening;
      const double middle = hole.from + hole.width / 2;
      opening.centre = turned ? Eigen::Vector2d(across, middle) : Eigen::Vector2d(middle, across);
      opening.width = hole.width, opening.sill = hole.sill, opening.head = hole.head;
      opening.thickness = thick_, opening.window = hole.window, opening.kind = hole.kind;
      site_.openings.push_back(opening);
      at = end;
    }
    piece(EntityLabel::wall, at, to, 0, h, -t, t);
  }

  template <class Piece>
  void leaf(const Hole& hole, double across, bool turned, const Piece& piece) {
    constexpr double t = 0.04;
    if (hole.window || hole.kind == DoorKind::open) return;
    const double end = hole.from + hole.width, side = chance(0.5) ? 1 : -1;
    if (hole.kind == DoorKind::flush || hole.kind == DoorKind::recessed) {
      // Its face lies behind the wall's on one side.
      const double behind = hole.kind == DoorKind::flush ? range(0.0, 0.015) : range(0.03, thick_ - 0.01);
      const double face = thick_ / 2 - behind;
      const double a = side > 0 ? face - t : -face, b = side > 0 ? face : -face + t;
      piece(EntityLabel::door, hole.from, end, 0.01, hole.head, a, b);
      return;
    }
    const double angle = side * (hole.kind == DoorKind::ajar ? range(0.15, 0.7) : range(1.3, 1.9));
    const Eigen::Vector2d hinge(hole.from, side * (thick_ / 2));
    const Eigen::Vector2d middle =
        hinge + Eigen::Rotation2Dd(angle) * Eigen::Vector2d(hole.width / 2 - 0.01, 0);
    const Eigen::Vector2d p = turned ? Eigen::Vector2d(across + middle.y(), middle.x())
                                     : Eigen::Vector2d(middle.x(), across + middle.y());
    const double yaw = turned ? EIGEN_PI / 2 - angle : angle;
    const Eigen::Vector3d half(hole.width / 2 - 0.01, t / 2, (hole.head - 0.01) / 2);
    const Eigen::Vector3d centre(p.x(), p.y(), 0.01 + half.z());
    box(EntityLabel::door, centre - half, centre + half, yaw);
  }

  Hole door(double low, double high) {
    Hole hole;
    hole.width = std::min(range(0.75, 1.1), high - low - 0.3);
    hole.from = range(low + 0.15, high - hole.width - 0.15);
    hole.head = std::min(range(1.95, 2.15), height_ - 0.25);
    hole.kind = static_cast<DoorKind>(whole(0, 4));
    return hole;
  }

  /// Rooms beside the corridor from x = 0 on; y of the corridor's side of their inner walls. The row's
  /// length.
  double row(double y, int side) {
    const int rooms = whole(1, 3);
    const double depth = range(3.0, 6.0), far = y + side * depth;
    double x = 0;
    for (int i = 0; i < rooms; ++i) {
      const double next = x + range(2.8, 5.5);
      doors_[side > 0].push_back(door(x + 0.1, next - 0.1));
      std::vector<Hole> windows;
      if (chance(0.7)) {
        Hole window;
        window.window = true;
        window.width = range(0.8, 1.8);
        window.from = range(x + 0.4, next - window.width - 0.4);
        window.sill = range(0.7, 1.1);
        window.head = std::min(range(1.9, 2.2), height_ - 0.2);
        windows.push_back(window);
      }
      wall(far + side * thick_ / 2, x, next, false, windows);
      if (i == 0) wall(x - thick_ / 2, std::min(y, far), std::max(y, far), true, {});
      wall(next + thick_ / 2, std::min(y, far), std::max(y, far), true, {});
      furnish({Eigen::Vector2d(x, std::min(y, far)), Eigen::Vector2d(next, std::max(y, far))}, side);
      if (!windows.empty() && chance(0.6)) {
        const double d = far + side * range(4, 12), w = range(1, 3);
        box(EntityLabel::unknown, {x, std::min(d, d + side), -0.5}, {x + w, std::max(d, d + side), 4});
      }
      x = next + thick_;
    }
    return x - thick_;
  }

  /// Keeps clear of the door's half of the room and of a scanner in its middle.
  void furnish(const Eigen::AlignedBox2d& room, int side) {
    const Eigen::Vector2d middle = room.center() + Eigen::Vector2d(range(-0.4, 0.4), range(-0.3, 0.3));
    if (chance(0.85)) stand(middle);
    const auto put = [&](double along, double deep, double low, double high, double at) {
      const double x = room.min().x() + at;
      const double wall = side > 0 ? room.max().y() : room.min().y();
      box(EntityLabel::unknown, {x, side > 0 ? wall - deep : wall, low},
          {std::min(x + along, room.max().x()), side > 0 ? wall : wall + deep, high});
    };
    const double free = room.sizes().x();
    if (chance(0.4)) put(range(0.8, 1.4), range(0.35, 0.6), 0, range(1.0, 2.1), 0);  // a cupboard
    if (chance(0.3)) put(range(1.2, free - 1.2), 0.6, 0, range(0.85, 0.95), 1.2);    // a counter
    if (chance(0.5)) put(0.45, 0.45, 0, 0.45, free - 0.6);                           // a stool
    if (chance(0.5)) {  // a table beside the scanner
      const Eigen::Vector2d p = middle + Eigen::Vector2d(0.9, side * 0.1);
      const double z = range(0.68, 0.78), w = std::min(1.2, room.max().x() - p.x() - 0.1);
      if (w > 0.5) {
        box(EntityLabel::unknown, {p.x(), p.y() - 0.4, z - 0.04}, {p.x() + w, p.y() + 0.4, z});
        for (const double dx : {0.05, w - 0.1}) {
          for (const double dy : {-0.35, 0.3})
            box(EntityLabel::unknown, {p.x() + dx, p.y() + dy, 0},
                {p.x() + dx + 0.05, p.y() + dy + 0.05, z - 0.04});
        }
      }
    }
    if (chance(0.25)) pillar(room.min() + Eigen::Vector2d(free * 0.3, room.sizes().y() * range(0.3, 0.7)));
  }

  void pillar(const Eigen::Vector2d& at) {
    const double w = range(0.2, 0.45);
    for (const Eigen::Vector3d& s : site_.scanners) {
      if ((s.head<2>() - at).norm() < 0.8) return;
    }
    box(EntityLabel::pillar, {at.x() - w / 2, at.y() - w / 2, 0}, {at.x() + w / 2, at.y() + w / 2, height_});
  }

  /// The corridor's side: with the doors of its rooms, and solid beyond them.
  void side_wall(double y, const std::vector<Hole>& doors, double to) {
    wall(y, 0, std::max(length_, to), false, doors);
  }
  void end_wall(double x, double from, double to) { wall(x, from - thick_, to + thick_, true, {}); }

  /// At the corridor's end, wider than it: stairs to a landing along one side, or a ramp.
  void hall(double width) {
    const double x0 = length_, y0 = -thick_, y1 = std::max(width + thick_, y0 + range(3.4, 5.0));
    const int steps = whole(3, 7);
    const double rise = range(0.14, 0.19), tread = range(0.25, 0.32), stairs = steps * tread;
    const double x1 = x0 + 1.6 + stairs + range(1.1, 1.8), wide = range(1.0, 1.5), top = height_;
    wall(y0 - thick_ / 2, x0, x1, false, {});
    wall(y1 + thick_ / 2, x0 - thick_, x1, false, {});
    wall(x1 + thick_ / 2, y0 - thick_, y1 + thick_, true, {}, top);
    if (y1 > width + thick_) wall(x0 - thick_ / 2, width + thick_, y1, true, {});
    stand({x0 + range(0.7, 1.1), y1 - range(0.9, 1.3)});
    if (chance(0.75)) {
      std::vector<double> rises;
      double z = 0;
      for (int i = 0; i < steps; ++i) {
        rises.push_back(rise + range(-0.004, 0.004));
        z += rises.back();
        const double a = x0 + 1.6 + i * tread;
        box(EntityLabel::stairs, {a, y0, 0}, {a + tread, y0 + wide, z});
      }
      box(kNotScored, {x0 + 1.6 + stairs, y0, 0}, {x1, y0 + wide, z});  // the landing: floor or last step
      site_.flights.push_back(rises);
    } else {
      const double slope = range(0.06, 0.14), l = stairs + 0.5;
      SemanticModel& model = site_.model;
      ModelEntity ramp = model_box("ramp", EntityLabel::unknown, {0, 0, 0}, {l, wide, 0.1});
      ramp.T_map_body =
          Transform<Map, Body>(Eigen::Quaterniond(Eigen::AngleAxisd(-slope, Eigen::Vector3d::UnitY())),
                               {x0 + 1.6 + l / 2, y0 + wide / 2, std::sin(slope) * l / 2 - 0.05});
      model.entities.push_back(ramp);
    }
    length_ = x1;
  }

  void stand(const Eigen::Vector2d& p) {
    if (site_.scanners.size() < 6) site_.scanners.emplace_back(p.x(), p.y(), range(1.0, 1.6));
  }

  void slabs() {
    const Eigen::Vector3d low = extent_.min(), high = extent_.max();
    box(EntityLabel::floor, {low.x(), low.y(), -0.2}, {high.x(), high.y(), 0});
    box(EntityLabel::ceiling, {low.x(), low.y(), height_}, {high.x(), high.y(), height_ + 0.2});
  }

  std::mt19937_64 random_;
  RandomSite site_;
  Eigen::AlignedBox3d extent_;
  double height_ = 0, thick_ = 0, length_ = 0;
  std::vector<Hole> doors_[2];
};

struct ScanOptions {
  double step = 0.014;     ///< rad, between rays
  double noise = 0.005;    ///< m, 1 sigma along the ray
  double reach = 25;       ///< m
  double tilt = 0.02;      ///< rad, of the cloud's frame
  double yaw = 0;          ///< rad
  bool viewpoints = true;  ///< whether the cloud says where its scanners stood
};

struct ScannedSite {
  cloud::PointCloud<Cloud> cloud;  ///< labels: EntityLabel of the box that each point was measured on
  Transform<Cloud, Map> T_cloud_site;
};

/// Rays in all directions from each scanner; nothing is seen within 0.3 m.
inline ScannedSite scan(const RandomSite& site, const ScanOptions& options, std::uint64_t seed) {
  SemanticModel marked = site.model;
  constexpr double kMarks = 4096;
  for (std::size_t i = 0; i < marked.entities.size(); ++i)
    marked.entities[i].material.laser_reflectivity = static_cast<float>(static_cast<double>(i + 1) / kMarks);
  const scan::BuildingTree tree(marked);
  std::mt19937_64 random(seed);
  const auto gaussian = [&] {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += static_cast<double>(random() >> 11) * 0x1.0p-53;
    return sum;
  };
  const Eigen::Quaterniond turn = Eigen::AngleAxisd(options.tilt, Eigen::Vector3d(0.6, 0.8, 0)) *
                                  Eigen::AngleAxisd(options.yaw, Eigen::Vector3d::UnitZ());
  ScannedSite result;
  result.T_cloud_site = Transform<Cloud, Map>(turn, -(turn * site.scanners.at(0)));
  for (std::size_t v = 0; v < site.scanners.size(); ++v) {
    const Eigen::Vector3d& from = site.scanners[v];
    if (options.viewpoints) result.cloud.viewpoints.push_back(result.T_cloud_site * from);
    for (double elevation = -1.3; elevation < 1.5; elevation += options.step) {
      const double around = options.step / std::max(0.1, std::cos(elevation));
      for (double azimuth = 0; azimuth < 2 * std::numbers::pi; azimuth += around) {
        const Eigen::Vector3d along(std::cos(elevation) * std::cos(azimuth),
                                    std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
        const auto hit = tree.cast(from, along, options.reach);
        if (!std::isfinite(hit.range) || hit.range < 0.3) continue;
        const auto box =
            static_cast<std::size_t>(std::lround(static_cast<double>(hit.reflectivity) * kMarks)) - 1;
        const Eigen::Vector3d p = from + (hit.range + options.noise * gaussian()) * along;
        result.cloud.points.push_back((result.T_cloud_site * p).cast<float>());
        result.cloud.scans.push_back(static_cast<std::uint16_t>(v));
        result.cloud.labels.push_back(static_cast<std::uint8_t>(marked.entities.at(box).label));
      }
    }
  }
  return result;
}

}  // namespace parhelion::test
