// Histogram picture of the points per centimetre of height around floor and ceiling.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "fusion/semantic/plan_canvas.hpp"
#include "fusion/semantic/site_heights.hpp"
#include "protocols/length_text.hpp"
#include "protocols/model.hpp"

namespace parhelion::semantic {
namespace {

constexpr int width = 1000, title_bar = 60;  // pixels
constexpr double panel_width = 440, panel_height = 210, margin = 40;
constexpr double bin = 0.01;  // m
constexpr int reach = 15;     // bins on either side of a level
constexpr std::size_t bins = 2 * reach;

const Colour ink{32, 38, 46}, faint{110, 119, 129}, paper{255, 255, 255};
const Colour any_point{205, 212, 220}, of_level{70, 120, 190}, mark{207, 34, 46};

struct Histogram {
  double low = 0;                              ///< m, lower edge of its first bin: a whole centimetre
  std::array<std::size_t, bins> all{}, own{};  ///< all points; those labelled as the level
};

Histogram histogram_of(const cloud::PointCloud<Map>& cloud, const Transform<Cloud, Map>& T_cloud_map,
                       bool level, EntityLabel label, double height) {
  Histogram histogram;
  histogram.low = (std::round(height / bin) - reach) * bin;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    const double z = level ? p.z() : (T_cloud_map * p).z();
    const auto at = static_cast<std::ptrdiff_t>(std::floor((z - histogram.low) / bin));
    if (at < 0 || at >= static_cast<std::ptrdiff_t>(bins)) continue;
    ++histogram.all[static_cast<std::size_t>(at)];
    if (cloud.labels[i] == static_cast<std::uint8_t>(label)) ++histogram.own[static_cast<std::size_t>(at)];
  }
  return histogram;
}

/// Label beside the tick of an axis, m.
std::string tick_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", std::abs(value) < 5e-4 ? 0.0 : value);
  return text;
}

/// `corner` is the panel's upper left corner; a red line marks `height`.
void draw(PlanCanvas& canvas, const Eigen::Vector2d& corner, const Histogram& histogram,
          const std::string& title, std::optional<double> height) {
  const double bottom = corner.y() + panel_height, step = panel_width / static_cast<double>(bins);
  const auto most = static_cast<double>(
      std::max<std::size_t>(1, *std::max_element(histogram.all.begin(), histogram.all.end())));
  canvas.text({corner.x(), corner.y() - 10}, title, 12, ink);
  for (std::size_t i = 0; i < bins; ++i) {
    const double left = corner.x() + step * static_cast<double>(i);
    const auto bar = [&](std::size_t count, Colour colour) {
      const double top = bottom - panel_height * static_cast<double>(count) / most;
      canvas.bar({Eigen::Vector2d(left + 1, top), Eigen::Vector2d(left + step - 1, bottom)}, colour);
    };
    bar(histogram.all[i], any_point);
    bar(histogram.own[i], of_level);
  }
  canvas.pixel_line({corner.x(), bottom}, {corner.x() + panel_width, bottom}, ink, 1.5);
  for (std::size_t i = 0; i <= bins; ++i) {
    const double z = histogram.low + bin * static_cast<double>(i);
    if (std::lround(z / bin) % 5 != 0) continue;
    const double x = corner.x() + step * static_cast<double>(i);
    canvas.pixel_line({x, bottom}, {x, bottom + 6}, ink, 1.5);
    if (i == 0 || i == bins) continue;  // numbers of two panels would overlap
    const std::string number = tick_text(z);
    canvas.text({x - canvas.text_width(number, 10) / 2, bottom + 22}, number, 10, ink);
  }
  if (!height) return;
  const double x = corner.x() + step * (*height - histogram.low) / bin;
  canvas.pixel_line({x, corner.y()}, {x, bottom}, mark, 2);
  canvas.text({x + 6, corner.y() + 12}, length_text(*height), 11, mark, true);
}

}  // namespace

Status write_heights(const cloud::PointCloud<Map>& cloud, const Transform<Map, Cloud>& T_map_cloud,
                     const SiteHeights& heights, const std::string& folder) {
  struct Row {
    const char* name;
    EntityLabel label;
    double height;
  };
  std::vector<Row> rows;
  if (heights.ceiling) rows.push_back({"Ceiling", EntityLabel::ceiling, heights.ceiling->median});
  if (heights.floor) rows.push_back({"Floor", EntityLabel::floor, heights.floor->median});
  if (rows.empty()) return {};
  const double row = panel_height + 90, tall = row * static_cast<double>(rows.size()) + 40;
  PlanCanvas canvas(width, {Eigen::Vector2d(0, 0), Eigen::Vector2d(width, tall)}, title_bar, 0);
  canvas.bar({Eigen::Vector2d(0, 0), Eigen::Vector2d(width, canvas.height())}, paper);
  canvas.text({margin, 40}, "Points at each centimetre of height", 16, ink);
  const Transform<Cloud, Map> T_cloud_map = T_map_cloud.inverse();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double top = title_bar + 40 + row * static_cast<double>(i);
    for (const bool level : {false, true}) {
      const Histogram histogram = histogram_of(cloud, T_cloud_map, level, rows[i].label, rows[i].height);
      const Eigen::Vector2d corner(level ? margin + panel_width + margin : margin, top);
      draw(canvas, corner, histogram,
           std::string(rows[i].name) + (level ? ", level" : ", as the first scan has it (its own z)"),
           level ? std::optional(rows[i].height) : std::nullopt);
    }
  }
  canvas.text({margin, canvas.height() - 16.0},
              "blue: points labelled so   grey: all others   red: median, m", 11, faint);
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  const std::string path = (std::filesystem::path(folder) / "heights.png").string();
  if (canvas.write(path)) return {};
  return Error{"cannot write " + path + ": give a folder that can be written"};
}

}  // namespace parhelion::semantic
