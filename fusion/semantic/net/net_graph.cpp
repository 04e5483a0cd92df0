#include "fusion/semantic/net/net_graph.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "fusion/semantic/pictures/plan_canvas.hpp"
#include "fusion/semantic/pictures/plan_legend.hpp"
#include "fusion/semantic/pictures/plan_outline.hpp"
#include "fusion/semantic/pictures/plan_palette.hpp"
#include "fusion/semantic/pictures/plan_view.hpp"

namespace parhelion::semantic {
namespace {

struct Kind {
  RelationKind kind;
  const char* word;  ///< label of the edge
  Colour colour;
  bool directed;
};
constexpr Kind kKinds[] = {
    {RelationKind::parallel, "parallel", {150, 160, 172}, false},
    {RelationKind::orthogonal, "orthogonal", {191, 160, 106}, false},
    {RelationKind::equal_height, "equal height", {140, 190, 160}, false},
    {RelationKind::above, "above", {130, 80, 223}, true},
    {RelationKind::under, "under", {188, 76, 0}, true},
    {RelationKind::available_inside, "inside", {9, 105, 218}, true},
    {RelationKind::connected_via_joint, "joint", {207, 34, 46}, true},
};

const Kind& kind_of(RelationKind kind) {
  return *std::find_if(std::begin(kKinds), std::end(kKinds), [&](const Kind& k) { return k.kind == kind; });
}

Colour colour_of(EntityLabel label) {
  switch (label) {
    case EntityLabel::wall:
      return {72, 84, 104};
    case EntityLabel::wall_above_door:
      return {120, 132, 152};
    case EntityLabel::floor:
      return {120, 120, 110};
    case EntityLabel::ceiling:
      return {160, 170, 180};
    case EntityLabel::door:
      return {214, 137, 16};
    case EntityLabel::free_space:
      return {84, 160, 96};
    case EntityLabel::stairs:
      return {80, 104, 160};
    case EntityLabel::ramp:
      return {110, 124, 150};
    case EntityLabel::window:
      return {84, 174, 255};
    case EntityLabel::pillar:
      return {120, 80, 130};
    case EntityLabel::unknown:
      return {150, 125, 95};
  }
  return {};
}

std::string escaped(const std::string& words) {
  std::string result;
  for (const char c : words) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result;
}

std::string quoted(const std::string& words) { return '"' + escaped(words) + '"'; }

template <class... Values>
std::string formatted(const char* format, Values... values) {
  char text[96];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

class Drawing {
 public:
  Drawing(const SemanticNet& net, const Eigen::AlignedBox2d& view, const std::string& left_out)
      : net_(net), canvas_(2000, view, palette::kTitleBar, PlanLegend::kHeight), left_out_(left_out) {
    for (const ModelEntity& entity : net.entities) place(entity);
  }

  bool write(const std::string& path) {
    outlines();
    for (const Kind& kind : kKinds) edges(kind);
    for (const ModelEntity& entity : net_.entities) node(entity);
    words();
    canvas_.bar({Eigen::Vector2d(0, 0), Eigen::Vector2d(canvas_.width(), palette::kTitleBar)},
                palette::kPaper);
    canvas_.text({24, 36},
                 "Semantic net: " + std::to_string(net_.entities.size()) + " entities, " +
                     std::to_string(net_.relations.size()) + " relations",
                 20, palette::kInk);
    canvas_.text({24, 62},
                 "label and confidence at each node; arrows: from is ... to" +
                     (left_out_.empty() ? "" : "; " + left_out_),
                 12, palette::kFaint);
    legend_.paint(canvas_);
    return canvas_.write(path);
  }

 private:
  static constexpr double kApart = 34;  ///< pixels between nodes

  /// At the entity's centre, or on a spiral around it where that is occupied.
  void place(const ModelEntity& entity) {
    const Eigen::Vector2d centre = canvas_.pixel(entity.T_map_body.translation().head<2>());
    Eigen::Vector2d at = centre;
    const auto taken = [&](const Eigen::Vector2d& p) {
      return std::any_of(nodes_.begin(), nodes_.end(),
                         [&](const auto& node) { return (node.second - p).norm() < kApart; });
    };
    for (int i = 1; i < 400 && taken(at); ++i)
      at = centre + 7 * std::sqrt(i) * Eigen::Vector2d(std::cos(2.4 * i), std::sin(2.4 * i));
    nodes_[entity.name] = at;
  }

  void outlines() {
    for (const ModelEntity& entity : net_.entities) {
      if (entity.label != EntityLabel::ceiling) canvas_.line(outline_of(entity), {216, 222, 228}, 1, true);
    }
  }

  bool on_plan(const Eigen::Vector2d& p) const {
    return p.x() > 0 && p.x() < canvas_.width() && p.y() > palette::kTitleBar &&
           p.y() < canvas_.plan_bottom();
  }

  void edges(const Kind& kind) {
    bool any = false;
    for (const Relation& relation : net_.relations) {
      const auto from = nodes_.find(relation.from), to = nodes_.find(relation.to);
      if (relation.kind != kind.kind || from == nodes_.end() || to == nodes_.end()) continue;
      if (!on_plan(from->second) || !on_plan(to->second)) continue;
      any = true;
      const Eigen::Vector2d along = (to->second - from->second).normalized(), across(-along.y(), along.x());
      // Offset by kind, so that two relations of one pair are two lines.
      const Eigen::Vector2d shift = 2.5 * (static_cast<double>(&kind - kKinds) - 3) * across;
      const Eigen::Vector2d a = from->second + shift, b = to->second + shift;
      canvas_.pixel_line(a, b, kind.colour, kind.directed ? 2 : 1);
      if (kind.directed) {
        const Eigen::Vector2d tip = b - 13 * along;
        for (const double side : {-1.0, 1.0})
          canvas_.pixel_line(tip, tip - 9 * along + side * 5 * across, kind.colour, 2);
      }
      middles_.push_back({a + 0.45 * (b - a), &kind, relation.confidence});
    }
    if (any) legend_.add({kind.word, kind.colour, LegendEntry::Mark::line});
  }

  void node(const ModelEntity& entity) {
    const Eigen::Vector2d& p = nodes_[entity.name];
    if (!on_plan(p)) return;
    canvas_.pixel_disc(p, 10, {255, 255, 255});
    canvas_.pixel_disc(p, 8.5, colour_of(entity.label));
    if (shown_.insert(entity.label).second)
      legend_.add({to_string(entity.label), colour_of(entity.label), LegendEntry::Mark::dot});
  }

  bool write_free(const Eigen::Vector2d& middle, const std::string& words, double size, Colour colour) {
    const Eigen::Vector2d half(canvas_.text_width(words, size) / 2 + 2, size / 2 + 3);
    const Eigen::AlignedBox2d box(middle - half, middle + half);
    const bool clear = std::none_of(label_boxes_.begin(), label_boxes_.end(),
                                    [&](const auto& other) { return other.intersects(box); });
    if (!clear || !on_plan(box.min()) || !on_plan(box.max())) return false;
    label_boxes_.push_back(box);
    canvas_.text({box.min().x() + 2, middle.y() + size / 2}, words, size, colour, true);
    return true;
  }

  void words() {
    for (const auto& [name, p] : nodes_)
      label_boxes_.emplace_back(Eigen::Vector2d(p.array() - 9), Eigen::Vector2d(p.array() + 9));
    for (const ModelEntity& entity : net_.entities) {
      const std::string text = entity.name + formatted(" %.2f", entity.confidence);
      const Eigen::Vector2d& p = nodes_[entity.name];
      for (const double away : {19.0, -19.0, 31.0, -31.0, 43.0, -43.0})
        if (write_free(p + Eigen::Vector2d(0, away), text, 11, colour_of(entity.label))) break;
    }
    std::stable_sort(middles_.begin(), middles_.end(),
                     [](const auto& a, const auto& b) { return a.kind->directed > b.kind->directed; });
    for (const Middle& m : middles_)
      write_free(m.at, m.kind->word + formatted(" %.2f", m.confidence), 8.5, m.kind->colour);
  }

  struct Middle {
    Eigen::Vector2d at;
    const Kind* kind;
    double confidence;
  };
  const SemanticNet& net_;
  PlanCanvas canvas_;
  std::string left_out_;
  PlanLegend legend_;
  std::map<std::string, Eigen::Vector2d> nodes_;  ///< pixels
  std::vector<Middle> middles_;
  std::vector<Eigen::AlignedBox2d> label_boxes_;
  std::set<EntityLabel> shown_;
};

}  // namespace

std::string net_to_dot(const SemanticNet& net) {
  std::string dot = "digraph semantic_net {\n  node [shape=box, style=filled, fillcolor=white];\n";
  for (const ModelEntity& entity : net.entities) {
    const Eigen::Vector3d p = entity.T_map_body.translation();
    dot += "  " + quoted(entity.name) + " [label=\"" + escaped(entity.name) +
           formatted("\\n%s %.3f\"", to_string(entity.label), entity.confidence) +
           formatted(", pos=\"%.3f,%.3f!\"];\n", p.x(), p.y());
  }
  for (const Relation& relation : net.relations) {
    const Kind& kind = kind_of(relation.kind);
    dot += "  " + quoted(relation.from) + " -> " + quoted(relation.to) +
           formatted(" [label=\"%s %.3f\"", to_string(relation.kind), relation.confidence) +
           (kind.directed ? "];\n" : ", dir=none];\n");
  }
  return dot + "}\n";
}

Status write_net(const SemanticNet& net, const std::string& folder) {
  if (net.entities.empty()) return Error{"semantic net: it has no entities to draw"};
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  const std::filesystem::path into(folder);
  std::ofstream dot(into / "net.dot", std::ios::binary);
  dot << net_to_dot(net);
  dot.close();
  SemanticModel model;
  model.entities = net.entities;
  const MainPart shown = main_part(model);
  const Eigen::AlignedBox2d view = plan_box(shown.model);
  if (!dot || view.isEmpty() || !Drawing(net, view, shown.left_out).write((into / "net.png").string()))
    return Error{"semantic net: cannot write net.dot and net.png into " + folder +
                 ": give a folder that can be written"};
  return {};
}

}  // namespace parhelion::semantic
