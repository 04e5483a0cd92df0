#include "fusion/semantic/model_quality.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "protocols/length_text.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kSureOfRamp = 0.4;  ///< confidence; ramps are often half hidden, and right all the same
constexpr double kSure = 0.7;        ///< confidence
constexpr double kSeen = 0.4;        ///< fraction of a wall's piece
constexpr double kLeaf = 0.35;       ///< fraction of a door that something closes
constexpr double kLargeThing = 0.5;  ///< m^3, of an object without a kind

constexpr const char* kImage = "may be an image in a mirror";

std::string percent(double fraction) { return std::to_string(std::lround(100 * fraction)) + " %"; }

/// Why an entity is doubtful; empty: it is not.
std::string why(const ModelEntity& e) {
  const bool judged = e.label == EntityLabel::wall || e.label == EntityLabel::door ||
                      e.label == EntityLabel::pillar || e.label == EntityLabel::window ||
                      e.label == EntityLabel::stairs;
  if (e.locked || e.deleted || e.is_virtual) return "";
  if (e.label == EntityLabel::ramp && e.confidence < kSureOfRamp)
    return "confidence " + percent(e.confidence) + ": the floor may be bent";
  if (!judged) return "";
  if (e.label == EntityLabel::wall && e.observed < kSeen)
    return "only " + percent(e.observed) + " of it was measured";
  if (e.confidence < kSure) return "confidence " + percent(e.confidence);
  if (e.label == EntityLabel::door && e.observed < kLeaf && e.confidence < 0.5 * (1 + kSure))
    return "no leaf was measured";
  return "";
}

/// Whether more than a frame or a reveal of a box is behind a mirror of which only the geometry tells.
bool may_be_image(const BuiltModel& built, const Transform<Map, Body>& T_map_body,
                  const Eigen::Vector3d& size) {
  constexpr double kBehind = 0.3;  // m
  const Eigen::Vector3d half = 0.5 * size.x() * T_map_body.rotation().col(0);
  return std::any_of(built.mirrors.begin(), built.mirrors.end(), [&](const Mirror& mirror) {
    if (mirror.certain) return false;
    for (const double at : {-1.0, 0.0, 1.0}) {
      const Eigen::Vector2d p = (T_map_body.translation() + at * half).head<2>();
      if (mirror.depth_of(p) > kBehind && mirror.has_image_at(p)) return true;
    }
    return false;
  });
}

ModelDoubt doubt_of(const std::string& name, const Eigen::Vector3d& place, double extent,
                    const std::string& reason) {
  const auto tidy = [](double v) { return std::round(v * 1000) / 1000; };
  return {name, place.unaryExpr(tidy), tidy(extent), reason};
}

/// Without a floor nothing says where virtual robots may drive. Its place is the middle of the site.
std::optional<ModelDoubt> missing_floor(const BuiltModel& built) {
  Eigen::AlignedBox3d site;
  for (const ModelEntity& e : built.model.entities) {
    if (e.deleted) continue;
    if (e.label == EntityLabel::floor) return std::nullopt;
    site.extend(e.T_map_body.translation());
  }
  for (const Eigen::Vector3f& p : built.cloud.points) site.extend(p.cast<double>());
  if (site.isEmpty()) return std::nullopt;
  const Eigen::Vector3d middle = site.center();
  return doubt_of("floor", {middle.x(), middle.y(), site.min().z()}, site.sizes().head<2>().maxCoeff(),
                  "none was measured");
}

/// The whole site is doubtful where its unit is.
std::optional<ModelDoubt> wrong_unit(const BuiltModel& built) {
  if (built.unit_doubt.empty() || built.cloud.empty()) return std::nullopt;
  Eigen::AlignedBox3d site;
  for (const Eigen::Vector3f& p : built.cloud.points) site.extend(p.cast<double>());
  return doubt_of("unit", site.center(), site.sizes().head<2>().maxCoeff(), built.unit_doubt);
}

void find_doubts(const BuiltModel& built, std::vector<ModelDoubt>& doubts) {
  if (auto doubt = missing_floor(built)) doubts.push_back(*std::move(doubt));
  if (auto doubt = wrong_unit(built)) doubts.push_back(*std::move(doubt));
  for (const ModelEntity& e : built.model.entities) {
    const bool image = !e.locked && !e.deleted && !e.is_virtual && may_be_image(built, e.T_map_body, e.size);
    const std::string reason = image ? kImage : why(e);
    if (!reason.empty())
      doubts.push_back(doubt_of(e.name, e.T_map_body.translation(), e.size.head<2>().maxCoeff(), reason));
  }
  for (const ModelObject& o : built.objects) {
    if (may_be_image(built, o.T_map_body, o.size)) {
      doubts.push_back(doubt_of(o.name, o.T_map_body.translation(), o.size.head<2>().maxCoeff(), kImage));
      continue;
    }
    if (o.kind != ObjectKind::object || o.size.prod() < kLargeThing) continue;
    doubts.push_back(doubt_of(o.name, o.T_map_body.translation(), o.size.head<2>().maxCoeff(),
                              "of unknown kind, " + length_text(o.size.z()) + " high"));
  }
  std::stable_sort(doubts.begin(), doubts.end(),
                   [](const ModelDoubt& a, const ModelDoubt& b) { return a.extent > b.extent; });
}

}  // namespace

ModelQuality quality_of(const BuiltModel& built) {
  ModelQuality quality;
  quality.up_doubtful = built.up_doubtful;
  double seen = 0, floor = 0, covered = 0, unknown = 0;
  for (const ModelEntity& e : built.model.entities) {
    if (e.deleted) continue;
    if (e.label == EntityLabel::wall) quality.walls += e.size.x(), seen += e.observed * e.size.x();
    if (e.label == EntityLabel::floor) {
      quality.has_floor = true;
      floor += e.size.head<2>().prod();
      covered += e.observed * e.size.head<2>().prod();
    }
  }
  for (std::size_t i = 0; i < built.cloud.labels.size(); ++i) {
    unknown += built.cloud.labels[i] == static_cast<std::uint8_t>(EntityLabel::unknown) &&
               built.object_of[i] == kNoObject;
  }
  quality.wall_support = quality.walls > 0 ? seen / quality.walls : 0;
  quality.floor_cover = floor > 0 ? covered / floor : 0;
  quality.unknown = built.cloud.empty() ? 0 : unknown / static_cast<double>(built.cloud.size());
  find_doubts(built, quality.doubts);
  return quality;
}

std::string quality_line(const ModelQuality& quality) {
  constexpr std::size_t kNamed = 3;
  std::string line = quality.up_doubtful ? "its up direction is doubtful; " : "";
  line += quality.walls > 0
              ? "walls: " + length_text(quality.walls) + ", " + percent(quality.wall_support) + " measured"
              : "no walls";
  line += (quality.has_floor ? "; floors: " + percent(quality.floor_cover) + " measured; " : "; no floor; ") +
          percent(quality.unknown) + " of the points unknown; ";
  const std::size_t n = quality.doubts.size();
  line += n == 0 ? "no doubtful part" : std::to_string(n) + (n == 1 ? " doubtful part" : " doubtful parts");
  for (std::size_t k = 0; k < std::min(n, kNamed); ++k) {
    const ModelDoubt& doubt = quality.doubts[k];
    line += (k == 0 ? ": " : ", ") + doubt.entity + " (" + doubt.reason + ")";
  }
  return n > kNamed ? line + " and " + std::to_string(n - kNamed) + " more (`doubts` in the model has all)"
                    : line;
}

}  // namespace parhelion::semantic
