#include "tests/mean_sites/mean_score.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <map>
#include <optional>

#include "protocols/quantile.hpp"

namespace parhelion::test {
namespace {

constexpr double kNear = 0.10;      // m
constexpr double kPiece = 0.10;     // m
constexpr double kKerbPiece = 0.5;  // m
constexpr int kFew = 8;             // points of a piece of wall that was seen

using Boxes = std::vector<ModelEntity>;

double middle(std::vector<double> values) { return quantile(values, 0.5); }

/// m in the plan from a point to a box.
double distance(const ModelEntity& box, const Eigen::Vector3d& p) {
  const Eigen::Vector3d local = box.T_map_body.inverse() * p;
  return (local.head<2>().cwiseAbs() - 0.5 * box.size.head<2>()).cwiseMax(0).norm();
}
bool in_box(const ModelEntity& box, const Eigen::Vector3d& p, double margin) {
  const Eigen::Vector3d local = box.T_map_body.inverse() * p;
  return (local.cwiseAbs().array() < 0.5 * box.size.array() + margin).all();
}

class Scoring {
 public:
  Scoring(const MeanSite& site, const MeanScan& scan, const semantic::BuiltModel& built)
      : site_(site),
        scan_(scan),
        built_(built),
        T_site_map_((built.model.T_map_cloud * scan.T_cloud_site).inverse()) {
    const Transform<Map, Cloud> T_site_cloud = scan.T_cloud_site.inverse();
    for (const Eigen::Vector3f& p : scan.cloud.points) points_.push_back(T_site_cloud * p.cast<double>());
    for (ModelEntity e : built.model.entities) {
      e.T_map_body = T_site_map_ * e.T_map_body;
      found_.push_back(e);
    }
  }

  MeanScore run() {
    score_.sites = 1;
    drawn_walls();
    seen_walls();
    openings();
    pillars();
    steps();
    ramps();
    kerbs();
    labels();
    objects();
    return score_;
  }

 private:
  const Boxes& boxes() const { return site_.model.entities; }

  void drawn_walls() {
    for (const ModelEntity& e : found_) {
      if (e.label != EntityLabel::wall) continue;
      for (double s = -e.size.x() / 2 + kPiece / 2; s < e.size.x() / 2; s += kPiece) {
        const Eigen::Vector3d p = e.T_map_body * Eigen::Vector3d(s, 0, 0);
        const bool judged = std::none_of(boxes().begin(), boxes().end(), [&](const ModelEntity& box) {
          return box.label == kNotJudged && distance(box, p) < kNear && overlap_in_height(box, e);
        });
        if (!judged) continue;
        score_.drawn += kPiece;
        const bool right = std::any_of(boxes().begin(), boxes().end(), [&](const ModelEntity& box) {
          return box.label == EntityLabel::wall && distance(box, p) < kNear && overlap_in_height(box, e);
        });
        if (right) score_.drawn_right += kPiece;
        if (!right && is_free(e, p)) score_.crossing += kPiece;
      }
    }
  }
  static bool overlap_in_height(const ModelEntity& a, const ModelEntity& b) {
    const double low = std::max(a.T_map_body.translation().z() - a.size.z() / 2,
                                b.T_map_body.translation().z() - b.size.z() / 2);
    const double high = std::min(a.T_map_body.translation().z() + a.size.z() / 2,
                                 b.T_map_body.translation().z() + b.size.z() / 2);
    return high - low > 0.3 * std::min(a.size.z(), b.size.z());
  }
  /// Whether most of the wall's height at `p` is far from anything.
  bool is_free(const ModelEntity& e, const Eigen::Vector3d& p) const {
    int free = 0, all = 0;
    for (double z = -0.45 * e.size.z(); z < 0.45 * e.size.z(); z += 0.1) {
      const Eigen::Vector3d q = p + Eigen::Vector3d(0, 0, z);
      ++all;
      free += std::none_of(boxes().begin(), boxes().end(),
                           [&](const ModelEntity& box) { return in_box(box, q, 0.1); });
    }
    return 2 * free > all;
  }

  void seen_walls() {
    for (std::size_t b = 0; b < boxes().size(); ++b) {
      const ModelEntity& box = boxes()[b];
      if (box.label != EntityLabel::wall || box.size.z() < 1.5) continue;
      const int axis = box.size.x() > box.size.y() ? 0 : 1;
      const auto pieces = static_cast<std::size_t>(box.size[axis] / kPiece);
      if (pieces == 0) continue;
      std::vector<int> counts[2] = {std::vector<int>(pieces), std::vector<int>(pieces)};
      for (std::size_t i = 0; i < points_.size(); ++i) {
        if (scan_.box[i] != b) continue;
        const Eigen::Vector3d local = box.T_map_body.inverse() * points_[i];
        const auto k = static_cast<std::ptrdiff_t>(std::floor((local[axis] + box.size[axis] / 2) / kPiece));
        if (k < 0 || k >= std::ssize(counts[0]) || std::abs(local.z()) > 0.45 * box.size.z()) continue;
        ++counts[local[1 - axis] > 0 ? 1 : 0][static_cast<std::size_t>(k)];
      }
      for (int side = 0; side < 2; ++side) {
        for (std::size_t k = 0; k < pieces; ++k) {
          if (counts[side][k] < kFew) continue;
          Eigen::Vector3d p = Eigen::Vector3d::Zero();
          p[axis] = (static_cast<double>(k) + 0.5) * kPiece - box.size[axis] / 2;
          p[1 - axis] = (side == 1 ? 0.5 : -0.5) * box.size[1 - axis];
          const Eigen::Vector3d at = box.T_map_body * p;
          score_.seen += kPiece;
          if (std::any_of(found_.begin(), found_.end(), [&](const ModelEntity& e) {
                return e.label == EntityLabel::wall && distance(e, at) < kNear && overlap_in_height(box, e);
              }))
            score_.seen_found += kPiece;
        }
      }
    }
  }

  void openings() {
    std::vector<bool> matched(site_.doors.size());
    for (const ModelEntity& e : found_) {
      if (e.label != EntityLabel::door) continue;
      Eigen::Vector2d in_door(0, 0);
      if (e.hinge)
        in_door = e.hinge->axis - Eigen::Rotation2Dd(e.hinge->closed).toRotationMatrix() * e.hinge->axis;
      const Eigen::Vector2d p = (e.T_map_body * Eigen::Vector3d(in_door.x(), in_door.y(), 0)).head<2>();
      bool right = false;
      for (std::size_t d = 0; d < site_.doors.size(); ++d) {
        if ((site_.doors[d].centre - p).norm() > 0.4) continue;
        right = true;
        matched[d] = true;
      }
      score_.false_doors += !right;
    }
    for (std::size_t d = 0; d < matched.size(); ++d) {
      if (!was_seen(site_.doors[d])) continue;
      ++score_.doors;
      score_.doors_found += matched[d];
    }
  }

  /// Whether points of the wall at both sides of a doorway were measured.
  bool was_seen(const TrueDoor& door) const {
    constexpr double kBeside = 0.4, kOff = 0.15, kLow = 0.2, kHigh = 2.0;  // m
    int left = 0, right = 0;
    for (const Eigen::Vector3d& p : points_) {
      if (p.z() < door.floor + kLow || p.z() > door.floor + kHigh) continue;
      const Eigen::Vector2d d = p.head<2>() - door.centre;
      const double s = door.along.dot(d), off = door.along.x() * d.y() - door.along.y() * d.x();
      const double beside = std::abs(s) - 0.5 * door.width;
      if (std::abs(off) > kOff || beside < 0 || beside > kBeside) continue;
      ++(s < 0 ? left : right);
    }
    return left >= kFew && right >= kFew;
  }

  void pillars() {
    for (const ModelEntity& e : found_) {
      if (e.label != EntityLabel::pillar) continue;
      score_.false_pillars += std::none_of(boxes().begin(), boxes().end(), [&](const ModelEntity& box) {
        return box.label == EntityLabel::pillar && distance(box, e.T_map_body.translation()) < 0.3;
      });
    }
  }

  static double top(const ModelEntity& e) { return e.T_map_body.translation().z() + e.size.z() / 2; }

  void steps() {
    std::vector<bool> used(found_.size());
    std::vector<bool> hit(site_.flights.size());
    for (std::size_t f = 0; f < site_.flights.size(); ++f) {
      for (const Eigen::AlignedBox3d& tread : site_.flights[f].treads) {
        const Eigen::Vector3d centre(tread.center().x(), tread.center().y(), tread.max().z());
        int points = 0;
        for (const Eigen::Vector3d& p : points_) {
          points += std::abs(p.z() - centre.z()) < 0.05 && p.x() > tread.min().x() &&
                    p.x() < tread.max().x() && p.y() > tread.min().y() && p.y() < tread.max().y();
        }
        bool found = false;
        for (std::size_t k = 0; k < found_.size(); ++k) {
          const ModelEntity& e = found_[k];
          if (e.label != EntityLabel::stairs || distance(e, centre) > 0.05 ||
              std::abs(top(e) - centre.z()) > 0.05)
            continue;
          found = used[k] = true;
        }
        hit[f] = hit[f] || found;
        if (points < 20) continue;
        score_.steps += 1;
        score_.steps_found += found;
      }
    }
    for (std::size_t k = 0; k < found_.size(); ++k) {
      if (found_[k].label != EntityLabel::stairs || used[k]) continue;
      const Eigen::Vector3d p(found_[k].T_map_body.translation().x(), found_[k].T_map_body.translation().y(),
                              top(found_[k]));
      // The last level of a flight is the landing.
      const bool near_flight =
          std::any_of(site_.flights.begin(), site_.flights.end(), [&](const TrueFlight& flight) {
            return std::any_of(flight.treads.begin(), flight.treads.end(),
                               [&](const Eigen::AlignedBox3d& tread) {
                                 return (p.head<2>() - tread.center().head<2>()).norm() <
                                            tread.sizes().head<2>().maxCoeff() + 0.5 &&
                                        std::abs(p.z() - tread.max().z()) < 0.06;
                               });
          });
      score_.false_steps += !near_flight;
    }
    flights();
  }
  void flights() {
    for (const semantic::StairsFlight& flight : built_.net.stairs) {
      double best = 1e9;
      bool right = false;
      for (std::size_t k = 0; k < found_.size(); ++k) {
        if (found_[k].label != EntityLabel::stairs || found_[k].part_of != flight.name) continue;
        for (const TrueFlight& truth : site_.flights) {
          for (const Eigen::AlignedBox3d& tread : truth.treads)
            right = right || (distance(found_[k], tread.center()) < 0.05 &&
                              std::abs(top(found_[k]) - tread.max().z()) < 0.06);
          if (!flight.rises.empty() && !truth.rises.empty())
            best = std::min(best, std::abs(middle(flight.rises) - middle(truth.rises)));
        }
      }
      if (right) score_.rise_error = std::max(score_.rise_error, best);
      score_.false_flights += !right;
    }
  }

  /// Found: its middle on a true one, half of either's length and width at least, and a slope within 1.5
  /// degrees.
  void ramps() {
    std::vector<bool> used(found_.size());
    for (const std::size_t r : site_.ramps) {
      const ModelEntity& truth = boxes()[r];
      const auto on_top = [&](std::size_t i) {
        return scan_.box[i] == r && (truth.T_map_body.inverse() * points_[i]).z() > 0.4 * truth.size.z();
      };
      int points = 0;
      for (std::size_t i = 0; i < points_.size(); ++i) points += on_top(i);
      const bool measured = points >= 50 * truth.size.x() * truth.size.y();
      score_.ramps += measured;
      bool found = !measured;
      for (std::size_t k = 0; k < found_.size(); ++k) {
        const ModelEntity& e = found_[k];
        if (e.label != EntityLabel::ramp || distance(truth, e.T_map_body.translation()) > 0.05) continue;
        const double turn =
            std::acos(std::min(1.0, e.T_map_body.rotation().col(2).dot(truth.T_map_body.rotation().col(2))));
        const Eigen::Vector2d off = (e.size - truth.size).head<2>().cwiseAbs();
        used[k] = true;
        if (found || turn > 0.026 || (off.array() > 0.5 * truth.size.head<2>().array()).any()) continue;
        found = true;
        score_.slope_error += turn;
        score_.edge_error += off.mean();
      }
      score_.ramps_found += measured && found;
    }
    for (std::size_t k = 0; k < found_.size(); ++k)
      score_.false_ramps += found_[k].label == EntityLabel::ramp && !used[k];
  }

  /// Found: half of what was measured of it, within 15 cm.
  void kerbs() {
    std::vector<bool> used(built_.objects.size());
    for (const TrueKerb& truth : site_.kerbs) {
      const Eigen::Vector2d along = (truth.to - truth.from).normalized(), up(-along.y(), along.x());
      const auto pieces = static_cast<std::size_t>((truth.to - truth.from).norm() / kKerbPiece) + 1;
      std::vector<int> low(pieces), high(pieces);
      for (const Eigen::Vector3d& p : points_) {
        const Eigen::Vector2d from = p.head<2>() - truth.from;
        const double u = along.dot(from) / kKerbPiece, v = up.dot(from);
        if (u < 0 || u >= static_cast<double>(pieces) || std::abs(v) > 0.5) continue;
        if (v < 0 && std::abs(p.z() - truth.low) < 0.04) ++low[static_cast<std::size_t>(u)];
        if (v > 0 && std::abs(p.z() - truth.high) < 0.04) ++high[static_cast<std::size_t>(u)];
      }
      int seen = 0, covered = 0;
      double error = 0;
      for (std::size_t k = 0; k < pieces; ++k) {
        if (low[k] < kFew || high[k] < kFew) continue;
        ++seen;
        const Eigen::Vector2d at = truth.from + (static_cast<double>(k) + 0.5) * kKerbPiece * along;
        const auto off = kerb_at(Eigen::Vector3d(at.x(), at.y(), 0.5 * (truth.low + truth.high)), used);
        covered += off.has_value();
        error += off.value_or(0);
      }
      if (seen * kKerbPiece < 2) continue;
      ++score_.kerbs;
      if (2 * covered < seen) continue;
      ++score_.kerbs_found;
      score_.kerb_error += error / covered;
    }
    for (std::size_t k = 0; k < used.size(); ++k)
      score_.false_kerbs += built_.objects[k].kind == ObjectKind::kerb && !used[k];
  }
  /// m from a place on a true edge to the edge of one of ours; nullopt: none within 15 cm.
  std::optional<double> kerb_at(const Eigen::Vector3d& p, std::vector<bool>& used) const {
    for (std::size_t k = 0; k < used.size(); ++k) {
      const ModelObject& kerb = built_.objects[k];
      if (kerb.kind != ObjectKind::kerb) continue;
      const Eigen::Vector3d at = (T_site_map_ * kerb.T_map_body).inverse() * p;
      const double off = std::abs(at.y() + kerb.size.y() / 2);
      if (std::abs(at.x()) > kerb.size.x() / 2 || off > 0.15 || std::abs(at.z()) > 0.1) continue;
      used[k] = true;
      return off;
    }
    return std::nullopt;
  }

  void labels() {
    std::vector<bool> of_object(boxes().size());
    for (const TrueObject& object : site_.objects) {
      for (const std::size_t b : object.boxes) of_object[b] = true;
    }
    const auto& labels = built_.cloud.labels;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const auto label = static_cast<EntityLabel>(labels[i]);
      score_.points += 1;
      score_.unknown += label == EntityLabel::unknown && built_.object_of[i] == semantic::kNoObject;
      if (scan_.box[i] == kNobody || !of_object[scan_.box[i]] || !over_floor(points_[i])) continue;
      score_.raised += 1;
      score_.called_floor += is_ground(label);
    }
  }
  bool over_floor(const Eigen::Vector3d& p) const {
    return std::none_of(boxes().begin(), boxes().end(), [&](const ModelEntity& box) {
      return box.label == EntityLabel::floor && std::abs(p.z() - top(box)) < 0.25 && distance(box, p) < 0.05;
    });
  }

  /// Instances by the points that they share with a true one: intersection over union.
  void objects() {
    std::vector<std::uint32_t> truth_of_box(boxes().size(), kNone);
    for (std::uint32_t o = 0; o < site_.objects.size(); ++o) {
      for (const std::size_t b : site_.objects[o].boxes) truth_of_box[b] = o;
    }
    for (const std::size_t b : site_.ramps) truth_of_box[b] = kNone;
    std::vector<int> there(site_.objects.size()), found(built_.objects.size());
    std::vector<int> amid(built_.objects.size());  // points on no object at all
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> both;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const std::uint32_t truth = scan_.box[i] == kNobody ? kNone : truth_of_box[scan_.box[i]];
      const std::uint32_t object = built_.object_of[i];
      if (truth != kNone) ++there[truth];
      if (object != semantic::kNoObject) ++found[object], amid[object] += truth == kNone;
      if (truth != kNone && object != semantic::kNoObject) ++both[{truth, object}];
    }
    for (std::uint32_t t = 0; t < there.size(); ++t) {
      if (there[t] < kEnough) continue;
      ++score_.objects;
      for (std::uint32_t o = 0; o < found.size(); ++o) {
        const auto shared = both.find({t, o});
        if (shared == both.end() || 2 * shared->second <= there[t] + found[o] - shared->second) continue;
        ++score_.objects_found;
        const std::string kind = text_for(built_.objects[o]);
        score_.objects_right += same_kind(site_.objects[t].kind, kind);
        ++score_.kinds[{site_.objects[t].kind, kind}];
      }
    }
    for (std::size_t o = 0; o < found.size(); ++o) {
      if (10 * amid[o] <= 8 * found[o]) continue;
      ++score_.false_objects;
      ++score_.kinds[{"no object", text_for(built_.objects[o])}];
      ++score_.amid[mostly_on(static_cast<std::uint32_t>(o))];
    }
  }
  /// What most points of one of our objects lie on.
  std::string mostly_on(std::uint32_t object) const {
    std::map<std::string, int> count;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (built_.object_of[i] != object) continue;
      ++count[scan_.box[i] == kNobody ? "somebody" : to_string(boxes()[scan_.box[i]].label)];
    }
    return std::max_element(count.begin(), count.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; })
        ->first;
  }
  static std::string text_for(const ModelObject& object) {
    const std::string kind = to_string(object.kind);
    return object.posture == Posture::unknown ? kind : to_string(object.posture) + (" " + kind);
  }
  static bool same_kind(const std::string& truth, const std::string& found) {
    return truth == "thing" || truth == found;
  }

  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  static constexpr int kEnough = 60;  ///< points of an object that can be found
  const MeanSite& site_;
  const MeanScan& scan_;
  const semantic::BuiltModel& built_;
  Transform<Map, Map> T_site_map_;
  std::vector<Eigen::Vector3d> points_;  // site's frame
  Boxes found_;                          // site's frame
  MeanScore score_;
};

/// The scan without the points that the model left out.
MeanScan used_of(const MeanScan& scan, const semantic::BuiltModel& built) {
  MeanScan used{{}, {}, scan.T_cloud_site};
  for (std::size_t i = 0; i < scan.box.size(); ++i) {
    if (!built.left_out.empty() && built.left_out[i]) continue;
    used.cloud.points.push_back(scan.cloud.points[i]);
    used.box.push_back(scan.box[i]);
  }
  return used;
}

}  // namespace

MeanScore& MeanScore::operator+=(const MeanScore& o) {
  sites += o.sites, refused += o.refused;
  drawn += o.drawn, drawn_right += o.drawn_right, seen += o.seen, seen_found += o.seen_found;
  crossing += o.crossing, false_doors += o.false_doors, false_pillars += o.false_pillars;
  false_flights += o.false_flights, doors += o.doors, doors_found += o.doors_found;
  steps += o.steps, steps_found += o.steps_found, false_steps += o.false_steps;
  ramps += o.ramps, ramps_found += o.ramps_found, false_ramps += o.false_ramps;
  kerbs += o.kerbs, kerbs_found += o.kerbs_found, false_kerbs += o.false_kerbs, kerb_error += o.kerb_error;
  slope_error += o.slope_error, edge_error += o.edge_error;
  rise_error = std::max(rise_error, o.rise_error);
  raised += o.raised, called_floor += o.called_floor, points += o.points, unknown += o.unknown;
  for (const auto& [pair, count] : o.kinds) kinds[pair] += count;
  for (const auto& [label, count] : o.amid) amid[label] += count;
  objects += o.objects, objects_found += o.objects_found, objects_right += o.objects_right;
  false_objects += o.false_objects, seconds += o.seconds, processor += o.processor;
  return *this;
}

MeanScore score_model(const MeanSite& site, const MeanScan& scan, const semantic::BuiltModel& built) {
  return Scoring(site, used_of(scan, built), built).run();
}

std::vector<std::string> true_kinds(const MeanSite& site, const MeanScan& scan,
                                    const semantic::BuiltModel& built) {
  std::vector<std::string> kind_of_box(site.model.entities.size(), "no object");
  for (const TrueObject& object : site.objects) {
    for (const std::size_t b : object.boxes) kind_of_box[b] = object.kind;
  }
  const MeanScan used = used_of(scan, built);
  std::vector<std::map<std::string, int>> points(built.objects.size());
  for (std::size_t i = 0; i < built.object_of.size(); ++i) {
    if (built.object_of[i] == semantic::kNoObject) continue;
    ++points[built.object_of[i]][used.box[i] == kNobody ? "no object" : kind_of_box[used.box[i]]];
  }
  std::vector<std::string> kinds;
  for (const auto& of_object : points) {
    int all = 0;
    for (const auto& [kind, count] : of_object) all += count;
    const auto first = std::max_element(of_object.begin(), of_object.end(),
                                        [](const auto& a, const auto& b) { return a.second < b.second; });
    kinds.push_back(first != of_object.end() && 10 * first->second > 7 * all ? first->first : "");
  }
  return kinds;
}

MeanScore score_mean_site(SiteKind kind, Device device, std::uint64_t seed, const std::string& picture) {
  const MeanSite site = mean_site(kind, seed);
  const MeanScan scan = mean_scan(site, device, seed);
  semantic::ModelOptions options;
  options.segmentation.stages = picture;
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t start_processor = std::clock();
  const auto built = semantic::build_model(scan.cloud, options);
  const double processor = static_cast<double>(std::clock() - start_processor) / CLOCKS_PER_SEC;
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  MeanScore score;
  score.sites = score.refused = 1;
  if (!built) return score;
  score = score_model(site, scan, *built);
  score.seconds = seconds, score.processor = processor;
  return score;
}

}  // namespace parhelion::test
