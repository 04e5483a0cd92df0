// Pictures of every stage of the image-based pipeline (the paper's figures 2 and 3).
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "fusion/semantic/pictures/plan_canvas.hpp"
#include "fusion/semantic/pictures/plan_palette.hpp"
#include "fusion/semantic/segmentation/surface_search.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr int kWidth = 1200, kTitleBar = 64, kLegendBar = 44;  // pixels
constexpr std::size_t kMaxCells = 16'000'000;  // of a picture; larger sites are shown at lower resolution

const Colour kLineColour{207, 34, 46};
constexpr std::array<Colour, 8> kPalette{{{31, 119, 180},
                                          {214, 90, 30},
                                          {44, 140, 60},
                                          {190, 40, 50},
                                          {130, 90, 180},
                                          {120, 80, 60},
                                          {200, 80, 160},
                                          {0, 140, 150}}};

constexpr std::array<const char*, 3> kProjectionNames{"oxy", "oxz", "oyz"};
constexpr std::array<const char*, 3> kAxes{"x, y", "x, z", "y, z"};
constexpr std::array<const char*, 5> kStageNames{"input", "threshold", "filtered", "dilated", "skeleton"};
constexpr std::array<const char*, 5> kStageTitles{
    "Input: occupied layers per pixel", "Threshold: enough layers",
    "Filtered: isolated pixels removed (eq. 3)", "Dilated: neighbours joined",
    "Skeleton: lines one pixel wide"};

/// From zero (white) over blue to many layers (dark).
Colour shade(int value) {
  const double s = std::clamp(std::log2(1.0 + value) / 6, 0.0, 1.0);
  const auto mix = [&](double a, double b, double c) {
    return static_cast<std::uint8_t>(s < 0.5 ? a + (b - a) * 2 * s : b + (c - b) * (2 * s - 1));
  };
  return {mix(235, 90, 10), mix(242, 150, 20), mix(250, 210, 60)};
}

/// The metres shown by all pictures of a projection: all pixels except outliers.
Eigen::AlignedBox2d view_of(const Site& site, const std::vector<StagePixel>& pixels, bool from_above) {
  if (pixels.empty()) return {Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, 1)};
  const double pixel = site.options.pixel;
  Eigen::AlignedBox2d view;
  std::vector<int> values(pixels.size());
  for (const int axis : {0, 1}) {
    std::transform(pixels.begin(), pixels.end(), values.begin(),
                   [&](const StagePixel& p) { return axis == 0 ? p.x : p.y; });
    const double origin = axis == 1 && !from_above ? site.z_low - pixel : 0;
    view.min()[axis] = quantile(values, 0.002) * pixel + origin - 0.4;
    view.max()[axis] = quantile(values, 0.998) * pixel + origin + 0.4;
  }
  return view;
}

class StagePicture {
 public:
  StagePicture(const Site& site, Projection projection, const Eigen::AlignedBox2d& view)
      : projection_(projection), view_(view), canvas_(kWidth, view, kTitleBar, kLegendBar) {
    origin_ = {0, projection == Projection::oxy ? 0 : site.z_low - site.options.pixel};
    pixel_ = site.options.pixel;
  }

  void draw_pixels(const std::vector<StagePixel>& pixels, bool faded) {
    canvas_.bar({Eigen::Vector2d(0, 0), Eigen::Vector2d(kWidth, canvas_.height())}, palette::kPaper);
    const double area = view_.sizes().prod();
    const int coarse =
        std::max(1, static_cast<int>(std::ceil(std::sqrt(area / (pixel_ * pixel_) / kMaxCells))));
    const double side = pixel_ * coarse;
    const int columns = static_cast<int>(view_.sizes().x() / side) + 2;
    const int rows = static_cast<int>(view_.sizes().y() / side) + 2;
    const int x0 = static_cast<int>(std::floor((view_.min().x() - origin_.x()) / side));
    const int y0 = static_cast<int>(std::floor((view_.min().y() - origin_.y()) / side));
    std::vector<std::uint8_t> largest(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0);
    for (const StagePixel& p : pixels) {
      const int x = static_cast<int>(std::floor(p.x / double(coarse))) - x0;
      const int y = static_cast<int>(std::floor(p.y / double(coarse))) - y0;
      if (x < 0 || y < 0 || x >= columns || y >= rows) continue;
      auto& cell = largest[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) +
                           static_cast<std::size_t>(x)];
      cell = std::max(cell, p.value);
    }
    std::vector<Colour> cells(largest.size(), palette::kPaper);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (largest[i] > 0) cells[i] = faded ? Colour{205, 212, 220} : shade(largest[i]);
    }
    canvas_.draw_cells(cells, columns, side, origin_ + Eigen::Vector2d(x0, y0) * side);
  }

  PlanCanvas& canvas() { return canvas_; }

  bool write(const std::string& path, const std::string& title, const std::string& legend) {
    canvas_.bar({Eigen::Vector2d(0, 0), Eigen::Vector2d(kWidth, kTitleBar)}, palette::kPaper);
    canvas_.bar({Eigen::Vector2d(0, canvas_.plan_bottom()), Eigen::Vector2d(kWidth, canvas_.height())},
                palette::kPaper);
    const auto p = static_cast<std::size_t>(projection_);
    std::string plane = kProjectionNames[p];
    std::transform(plane.begin(), plane.end(), plane.begin(),
                   [](char c) { return c >= 'a' ? c - 'a' + 'A' : c; });
    canvas_.text({20, 41}, plane + "   " + title, 17, palette::kInk);
    canvas_.text({20, canvas_.height() - 16.0}, legend, 12, palette::kFaint);
    ticks();
    return canvas_.write(path);
  }

 private:
  /// Axis labels in metres along the lower and the left edge.
  void ticks() {
    const double span = kWidth / canvas_.pixels_per_metre();
    double step = 0.5;
    for (const double wider : {1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0}) {
      if (span / step > 14) step = wider;
    }
    const Eigen::Vector2d middle = view_.center();
    for (const int axis : {0, 1}) {
      const double half =
          axis == 0 ? span / 2 : (canvas_.plan_bottom() - kTitleBar) / canvas_.pixels_per_metre() / 2;
      for (double v = std::ceil((middle[axis] - half) / step) * step; v < middle[axis] + half; v += step) {
        std::ostringstream number;
        number << (std::abs(v) < 1e-9 ? 0.0 : v);
        const Eigen::Vector2d at =
            canvas_.pixel(axis == 0 ? Eigen::Vector2d(v, middle.y()) : Eigen::Vector2d(middle.x(), v));
        if (axis == 0) {
          const double bottom = canvas_.plan_bottom();
          if (at.x() < 60 || at.x() > kWidth - 40) continue;
          canvas_.pixel_line({at.x(), bottom - 9}, {at.x(), bottom}, palette::kInk, 1.5);
          canvas_.text({at.x() - canvas_.text_width(number.str(), 10) / 2, bottom - 14}, number.str(), 10,
                       palette::kInk, true);
        } else {
          if (at.y() < kTitleBar + 20 || at.y() > canvas_.plan_bottom() - 30) continue;
          canvas_.pixel_line({0, at.y()}, {9, at.y()}, palette::kInk, 1.5);
          canvas_.text({14, at.y() + 5}, number.str(), 10, palette::kInk, true);
        }
      }
    }
  }

  Projection projection_;
  Eigen::AlignedBox2d view_;
  PlanCanvas canvas_;
  Eigen::Vector2d origin_;
  double pixel_ = 0;
};

std::string legend_of(const Site& site, Projection projection, std::size_t count, const char* what) {
  std::ostringstream words;
  words << count << ' ' << what << "   axes " << kAxes[static_cast<std::size_t>(projection)]
        << " in metres   pixel " << std::lround(site.options.pixel * 1e4) / 100.0 << " cm";
  return words.str();
}

/// The horizontal surfaces as bars seen from the side, or the vertical ones as lines seen from above.
void draw_surfaces(PlanCanvas& canvas, Projection projection, const Segmentation& found) {
  std::size_t colour = 0;
  const auto label = [&](const Eigen::Vector2d& at, double metres) {
    std::ostringstream number;
    number << std::lround(metres * 100) / 100.0;
    const Eigen::Vector2d pixel = canvas.pixel(at);
    canvas.text({pixel.x() - canvas.text_width(number.str(), 10) / 2, pixel.y() - 5}, number.str(), 10,
                palette::kInk, true);
  };
  if (projection == Projection::oxy) {
    for (const VerticalSurface& s : found.verticals) {
      canvas.line({s.start, s.end}, kPalette[colour++ % kPalette.size()], 3.5);
      if ((s.end - s.start).norm() >= 1) label((s.start + s.end) / 2, (s.end - s.start).norm());
    }
    return;
  }
  const int axis = projection == Projection::oxz ? 0 : 1;
  for (const HorizontalSurface& s : found.horizontals) {
    canvas.line({{s.low[axis], s.z}, {s.high[axis], s.z}}, kPalette[colour++ % kPalette.size()], 3.5);
    label({s.high[axis], s.z}, s.z);
  }
}

}  // namespace

Status write_stages(const std::string& folder, const Site& site, const StageImages& stages,
                    const Segmentation& found) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  const auto path = [&](std::size_t p, int number, const std::string& name) {
    return (std::filesystem::path(folder) /
            (std::string(kProjectionNames[p]) + '_' + std::to_string(number) + '_' + name + ".png"))
        .string();
  };
  for (const Projection projection : {Projection::oxy, Projection::oxz, Projection::oyz}) {
    const auto p = static_cast<std::size_t>(projection);
    const auto& pixels = stages.pixels[p];
    const Eigen::AlignedBox2d view = view_of(site, pixels[0], projection == Projection::oxy);
    bool written = true;
    for (std::size_t s = 0; s < kStageNames.size(); ++s) {
      StagePicture picture(site, projection, view);
      picture.draw_pixels(pixels[s], false);
      written = written && picture.write(path(p, static_cast<int>(s) + 1, kStageNames[s]), kStageTitles[s],
                                         legend_of(site, projection, pixels[s].size(), "pixels"));
    }
    StagePicture hough(site, projection, view);
    hough.draw_pixels(pixels[2], true);
    for (const StageImages::Line& line : stages.hough[p])
      hough.canvas().line({line.a, line.b}, kLineColour, 2);
    written = written && hough.write(path(p, 6, "hough"), "Probabilistic Hough transform: proposals",
                                     legend_of(site, projection, stages.hough[p].size(), "segments"));
    StagePicture surfaces(site, projection, view);
    surfaces.draw_pixels(pixels[0], true);
    draw_surfaces(surfaces.canvas(), projection, found);
    const bool above = projection == Projection::oxy;
    written =
        written &&
        surfaces.write(path(p, 7, "surfaces"),
                       above ? "Vertical surfaces, lengths in m" : "Horizontal surfaces, heights in m",
                       legend_of(site, projection, above ? found.verticals.size() : found.horizontals.size(),
                                 "surfaces"));
    if (!written)
      return Error{"segmentation: cannot write the pictures of the stages into " + folder +
                   ": give a folder that can be written"};
  }
  return {};
}

}  // namespace parhelion::semantic
