#include "fusion/semantic/pictures/plan_picture.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "fusion/semantic/pictures/plan_canvas.hpp"
#include "fusion/semantic/pictures/plan_legend.hpp"
#include "fusion/semantic/pictures/plan_outline.hpp"
#include "fusion/semantic/pictures/plan_palette.hpp"
#include "protocols/angle_units.hpp"

namespace parhelion::semantic {
namespace {

const Colour kWallColour{84, 105, 141};
const Colour kDoorColour{191, 135, 0};
const Colour kVirtualWallColour{163, 113, 247};
const Colour kAgentColour{251, 143, 68};
const Colour kRobotColour{45, 164, 78};
const Colour kRealColour{0, 158, 190};
const Colour kInjectedColour{207, 34, 46};

Colour darker(Colour colour) {
  const auto half = [](std::uint8_t v) { return static_cast<std::uint8_t>(v / 2); };
  return {half(colour.red), half(colour.green), half(colour.blue)};
}

bool is_upright_part(const ModelEntity& entity) {
  return is_solid(entity) && !is_ground(entity.label) && entity.label != EntityLabel::ceiling;
}

void extend_by_map(const pose::GridMap& map, Eigen::AlignedBox2d& view) {
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const auto i =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(map.width) + static_cast<std::size_t>(x);
      if (std::abs(map.occupied[i] - 0.5F) < 0.1F) continue;
      view.extend(
          Eigen::Vector2d(map.x_min + (x + 0.5) * map.resolution, map.y_min + (y + 0.5) * map.resolution));
    }
  }
}

/// Bodies of the world with their definitions, agents' and the robot's only, lowest first.
struct SeenBody {
  const BodyDefinition* body;
  const BodyState* state;
};
std::vector<SeenBody> seen_bodies(const WorldSnapshot* world) {
  std::vector<SeenBody> seen;
  if (world == nullptr) return seen;
  for_each_body(*world, [&](const BodyDefinition& body, const BodyState& state) {
    if (body.owner != BodyOwner::building) seen.push_back({&body, &state});
  });
  std::stable_sort(seen.begin(), seen.end(), [](const SeenBody& a, const SeenBody& b) {
    return a.state->T_map_body.translation().z() < b.state->T_map_body.translation().z();
  });
  return seen;
}

Eigen::AlignedBox2d view_of(const PlanPicture& picture) {
  Eigen::AlignedBox2d view;
  const bool whole = picture.focus <= 0;
  if (whole && picture.map != nullptr) extend_by_map(*picture.map, view);
  if (whole && picture.model != nullptr) {
    for (const ModelEntity& entity : picture.model->entities) {
      if (!is_upright_part(entity)) continue;
      for (const Eigen::Vector2d& p : outline_of(entity)) view.extend(p);
    }
  }
  for (const PlanPath& path : picture.paths) {
    for (const Eigen::Vector2d& p : path.points) view.extend(p);
  }
  for (const SeenBody& seen : seen_bodies(picture.world)) {
    view.extend(Eigen::Vector2d(seen.state->T_map_body.translation().head<2>()));
  }
  // A scan's far returns may lie anywhere: its position counts, its returns only where nothing else gives an
  // extent.
  if (picture.scan) {
    view.extend(picture.scan->laser);
    if (picture.map == nullptr && picture.model == nullptr) {
      for (const Eigen::Vector2d& p : picture.scan->real) view.extend(p);
    }
  }
  if (view.isEmpty()) return view;
  const double margin = whole ? std::max(0.5, 0.03 * view.sizes().maxCoeff()) : picture.focus;
  return {view.min().array() - margin, view.max().array() + margin};
}

class PlanPictureRenderer {
 public:
  PlanPictureRenderer(const PlanPicture& picture, const Eigen::AlignedBox2d& view)
      : picture_(picture), canvas_(picture.width, view, palette::kTitleBar, PlanLegend::kHeight) {}

  bool paint(const std::string& path) {
    if (picture_.map != nullptr) paint_map();
    if (picture_.scan) paint_sweep();
    if (picture_.model != nullptr) paint_model();
    for (const PlanPath& each : picture_.paths) paint_path(each);
    paint_bodies();
    if (picture_.scan) paint_returns();
    paint_names();
    paint_title();
    legend_.paint(canvas_);
    return canvas_.write(path);
  }

 private:
  void paint_map() {
    canvas_.draw_map(*picture_.map);
    legend_.add({"occupied in the map", {38, 44, 54}, LegendEntry::Mark::area});
  }

  /// The area seen by the scan, as a light veil.
  void paint_sweep() {
    std::vector<Eigen::Vector2d> all = picture_.scan->real;
    all.insert(all.end(), picture_.scan->injected.begin(), picture_.scan->injected.end());
    const Eigen::Vector2d laser = picture_.scan->laser;
    std::vector<std::vector<Eigen::Vector2d>> rays;
    const double half = 0.5 * 0.5 * kRadiansPerDegree;
    for (const Eigen::Vector2d& p : all) {
      const Eigen::Vector2d beam = p - laser;
      const Eigen::Vector2d side = Eigen::Vector2d(-beam.y(), beam.x()) * half;
      rays.push_back({laser, p + side, p - side});
    }
    canvas_.fill(rays, kRealColour, 0.10);
  }

  void paint_model() {
    std::map<int, std::vector<Outline>> layers;  // by kind
    for (const ModelEntity& entity : picture_.model->entities) {
      if (!is_upright_part(entity)) continue;
      layers[entity.is_virtual ? 2 : entity.label == EntityLabel::door ? 1 : 0].push_back(outline_of(entity));
    }
    const LegendEntry kinds[] = {{"walls of the model", kWallColour, LegendEntry::Mark::area},
                                 {"doors", kDoorColour, LegendEntry::Mark::area},
                                 {"virtual walls", kVirtualWallColour, LegendEntry::Mark::area}};
    for (const auto& [kind, outlines] : layers) {
      const LegendEntry& entry = kinds[kind];
      canvas_.fill(outlines, entry.colour, 0.55);
      for (const Outline& outline : outlines) canvas_.line(outline, entry.colour, 1, true);
      legend_.add(entry);
    }
  }

  void paint_path(const PlanPath& path) {
    if (path.points.empty()) return;
    canvas_.line(path.points, palette::kPaper, 6);
    canvas_.line(path.points, path.colour, 3);
    canvas_.disc(path.points.front(), 7, path.colour);
    canvas_.disc(path.points.front(), 3.5, palette::kPaper);
    paint_arrow(path);
    const auto mark = path.entity.empty() ? LegendEntry::Mark::line : LegendEntry::Mark::body;
    if (!path.label.empty()) legend_.add({path.label, path.colour, mark});
  }

  /// Arrow at the end, along the last ten pixels.
  void paint_arrow(const PlanPath& path) {
    const Eigen::Vector2d tip = path.points.back();
    const double metre = 1 / canvas_.pixels_per_metre();
    const auto before = std::find_if(path.points.rbegin(), path.points.rend(),
                                     [&](const Eigen::Vector2d& p) { return (tip - p).norm() > 10 * metre; });
    if (before == path.points.rend()) return;
    const Eigen::Vector2d along = (tip - *before).normalized() * metre;
    const Eigen::Vector2d across(-along.y(), along.x());
    canvas_.fill(
        {{tip + 9 * along, tip - 7 * along + 8 * across, tip - 3 * along, tip - 7 * along - 8 * across}},
        path.colour, 1);
  }

  /// In the colour of the entity's path, else in that of its kind.
  void paint_bodies() {
    bool agents = false, robots = false;
    for (const SeenBody& seen : seen_bodies(picture_.world)) {
      const bool real = seen.body->owner == BodyOwner::real_robot;
      const auto own = std::find_if(picture_.paths.begin(), picture_.paths.end(),
                                    [&](const PlanPath& path) { return path.entity == seen.body->entity; });
      const bool has_path = own != picture_.paths.end();
      const Colour colour = has_path ? own->colour : real ? kRobotColour : kAgentColour;
      Outline corners;
      for (const Shape& shape : seen.body->shapes) {
        for (const Eigen::Vector2d& p : outline_of(shape, seen.state->T_map_body)) corners.push_back(p);
      }
      const Outline outline = convex_hull(std::move(corners));
      canvas_.fill({outline}, colour, 0.85);
      canvas_.line(outline, darker(colour), 1.5, true);
      if (!has_path) (real ? robots : agents) = true;
      Eigen::AlignedBox2d& extent = extents_[seen.body->entity];
      for (const Eigen::Vector2d& p : outline) extent.extend(canvas_.pixel(p));
    }
    if (robots) legend_.add({"real robot", kRobotColour, LegendEntry::Mark::area});
    if (agents) legend_.add({"virtual agents", kAgentColour, LegendEntry::Mark::area});
  }

  void paint_returns() {
    for (const Eigen::Vector2d& p : picture_.scan->real) canvas_.disc(p, 2.2, kRealColour);
    for (const Eigen::Vector2d& p : picture_.scan->injected) canvas_.disc(p, 2.8, kInjectedColour);
    canvas_.disc(picture_.scan->laser, 5, palette::kPaper);
    canvas_.disc(picture_.scan->laser, 3.5, kRealColour);
    legend_.add({"real returns", kRealColour, LegendEntry::Mark::dot});
    if (!picture_.scan->injected.empty()) {
      legend_.add({"virtual returns", kInjectedColour, LegendEntry::Mark::dot});
    }
  }

  /// Names beside each body, without overlap.
  void paint_names() {
    constexpr double size = 13, gap = 7;
    std::vector<Eigen::AlignedBox2d> taken;
    for (const auto& [name, extent] : extents_) {
      const double width = canvas_.text_width(name, size);
      const Eigen::Vector2d places[] = {{extent.max().x() + gap, extent.center().y() + size / 2},
                                        {extent.min().x() - gap - width, extent.center().y() + size / 2},
                                        {extent.center().x() - width / 2, extent.min().y() - gap},
                                        {extent.center().x() - width / 2, extent.max().y() + gap + size},
                                        {extent.max().x() + gap, extent.min().y() - gap},
                                        {extent.max().x() + gap, extent.max().y() + gap + size}};
      const auto box_at = [&](const Eigen::Vector2d& p) {
        return Eigen::AlignedBox2d(Eigen::Vector2d(p.x() - 3, p.y() - size - 3),
                                   Eigen::Vector2d(p.x() + width + 3, p.y() + 5));
      };
      const Eigen::AlignedBox2d plan(Eigen::Vector2d(4, canvas_.title_bar() + 4),
                                     Eigen::Vector2d(canvas_.width() - 4, canvas_.plan_bottom() - 4));
      const auto is_free = [&](const Eigen::Vector2d& p) {
        return plan.contains(box_at(p)) && std::none_of(taken.begin(), taken.end(), [&](const auto& other) {
                 return other.intersects(box_at(p));
               });
      };
      const auto* place = std::find_if(std::begin(places), std::end(places), is_free);
      if (place == std::end(places)) place = std::begin(places);
      taken.push_back(box_at(*place));
      canvas_.text(*place, name, size, palette::kInk, true);
    }
  }

  void paint_title() {
    canvas_.bar({Eigen::Vector2d(0, 0), Eigen::Vector2d(canvas_.width(), palette::kTitleBar)},
                palette::kPaper);
    canvas_.pixel_line({0, palette::kTitleBar}, {double(canvas_.width()), palette::kTitleBar}, palette::kRule,
                       1);
    canvas_.text({24, 36}, picture_.title, 20, palette::kInk);
    canvas_.text({24, 62}, picture_.subtitle, 12, palette::kFaint);
  }

  const PlanPicture& picture_;
  PlanCanvas canvas_;
  PlanLegend legend_;
  std::map<std::string, Eigen::AlignedBox2d> extents_;  ///< pixels, by entity
};

}  // namespace

PlanScan plan_scan(const Scan& scan, const LaserDescription& laser, std::span<const std::int16_t> beam_agent,
                   const Transform<Map, Base>& T_map_base) {
  PlanScan plan;
  const Transform<Map, Laser> T_map_laser = T_map_base * laser.T_base_laser;
  plan.laser = T_map_laser.translation().head<2>();
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const float range = scan.ranges[i];
    if (laser.convention.classify(range) != BeamKind::hit) continue;
    const double angle = scan.angle(i);
    const Eigen::Vector3d p =
        T_map_laser * Eigen::Vector3d(range * std::cos(angle), range * std::sin(angle), 0);
    const bool injected = i < beam_agent.size() && beam_agent[i] >= 0;
    (injected ? plan.injected : plan.real).push_back(p.head<2>());
  }
  return plan;
}

Status draw_plan(const PlanPicture& picture, const std::string& path) {
  if (picture.width < 400 || picture.width > 10'000) {
    return Error{path + ": picture width: expected 400 <= width <= 10000 pixels, found " +
                 std::to_string(picture.width)};
  }
  const Eigen::AlignedBox2d view = view_of(picture);
  if (view.isEmpty())
    return Error{path + ": there is nothing to draw: no map, model, path, body or scan with an extent"};
  if (!view.min().allFinite() || !view.max().allFinite())
    return Error{path + ": coordinates that are not finite"};
  try {
    if (PlanPictureRenderer(picture, view).paint(path)) return {};
  } catch (const cv::Exception& fault) {
    return Error{path + ": the picture cannot be made: " + fault.err};
  }
  return Error{path +
               ": the picture cannot be written: does the folder exist, and does the name end in .png?"};
}

}  // namespace parhelion::semantic
