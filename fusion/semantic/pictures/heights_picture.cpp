// Histogram picture of the points per centimetre of height around floor and ceiling.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "fusion/semantic/pictures/plan_canvas.hpp"
#include "fusion/semantic/pictures/plan_palette.hpp"
#include "fusion/semantic/site_heights.hpp"
#include "protocols/length_text.hpp"
#include "protocols/model.hpp"

namespace parhelion::semantic {
namespace {

constexpr int kWidth = 1000, kTitleBar = 60;  // pixels
constexpr double kPanelWidth = 440, kPanelHeight = 210, kMargin = 40;
constexpr double kBin = 0.01;  // m
constexpr int kReach = 15;     // bins on either side of a level
constexpr std::size_t kBins = 2 * kReach;

const Colour kAnyPoint{205, 212, 220}, kLevel{70, 120, 190}, kMark{207, 34, 46};

struct Histogram {
  double low = 0;                               ///< m, lower edge of its first bin: a whole centimetre
  std::array<std::size_t, kBins> all{}, own{};  ///< all points; those labelled as the level
};

Histogram histogram_of(const cloud::PointCloud<Map>& cloud, const Transform<Cloud, Map>& T_cloud_map,
                       bool level, EntityLabel label, double height) {
  Histogram histogram;
  histogram.low = (std::round(height / kBin) - kReach) * kBin;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    const double z = level ? p.z() : (T_cloud_map * p).z();
    const auto at = static_cast<std::ptrdiff_t>(std::floor((z - histogram.low) / kBin));
    if (at < 0 || at >= static_cast<std::ptrdiff_t>(kBins)) continue;
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
  const double bottom = corner.y() + kPanelHeight, step = kPanelWidth / static_cast<double>(kBins);
  const auto max_count = static_cast<double>(
      std::max<std::size_t>(1, *std::max_element(histogram.all.begin(), histogram.all.end())));
  canvas.text({corner.x(), corner.y() - 10}, title, 12, palette::kInk);
  for (std::size_t i = 0; i < kBins; ++i) {
    const double left = corner.x() + step * static_cast<double>(i);
    const auto bar = [&](std::size_t count, Colour colour) {
      const double top = bottom - kPanelHeight * static_cast<double>(count) / max_count;
      canvas.bar({Eigen::Vector2d(left + 1, top), Eigen::Vector2d(left + step - 1, bottom)}, colour);
    };
    bar(histogram.all[i], kAnyPoint);
    bar(histogram.own[i], kLevel);
  }
  canvas.pixel_line({corner.x(), bottom}, {corner.x() + kPanelWidth, bottom}, palette::kInk, 1.5);
  for (std::size_t i = 0; i <= kBins; ++i) {
    const double z = histogram.low + kBin * static_cast<double>(i);
    if (std::lround(z / kBin) % 5 != 0) continue;
    const double x = corner.x() + step * static_cast<double>(i);
    canvas.pixel_line({x, bottom}, {x, bottom + 6}, palette::kInk, 1.5);
    if (i == 0 || i == kBins) continue;  // numbers of two panels would overlap
    const std::string number = tick_text(z);
    canvas.text({x - canvas.text_width(number, 10) / 2, bottom + 22}, number, 10, palette::kInk);
  }
  if (!height) return;
  const double x = corner.x() + step * (*height - histogram.low) / kBin;
  canvas.pixel_line({x, corner.y()}, {x, bottom}, kMark, 2);
  canvas.text({x + 6, corner.y() + 12}, length_text(*height), 11, kMark, true);
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
  const double row = kPanelHeight + 90, tall = row * static_cast<double>(rows.size()) + 40;
  PlanCanvas canvas(kWidth, {Eigen::Vector2d(0, 0), Eigen::Vector2d(kWidth, tall)}, kTitleBar, 0);
  canvas.bar({Eigen::Vector2d(0, 0), Eigen::Vector2d(kWidth, canvas.height())}, palette::kPaper);
  canvas.text({kMargin, 40}, "Points at each centimetre of height", 16, palette::kInk);
  const Transform<Cloud, Map> T_cloud_map = T_map_cloud.inverse();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double top = kTitleBar + 40 + row * static_cast<double>(i);
    for (const bool level : {false, true}) {
      const Histogram histogram = histogram_of(cloud, T_cloud_map, level, rows[i].label, rows[i].height);
      const Eigen::Vector2d corner(level ? kMargin + kPanelWidth + kMargin : kMargin, top);
      draw(canvas, corner, histogram,
           std::string(rows[i].name) + (level ? ", level" : ", as the first scan has it (its own z)"),
           level ? std::optional(rows[i].height) : std::nullopt);
    }
  }
  canvas.text({kMargin, canvas.height() - 16.0},
              "blue: points labelled so   grey: all others   red: median, m", 11, palette::kFaint);
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  const std::string path = (std::filesystem::path(folder) / "heights.png").string();
  if (canvas.write(path)) return {};
  return Error{"cannot write " + path + ": give a folder that can be written"};
}

}  // namespace parhelion::semantic
