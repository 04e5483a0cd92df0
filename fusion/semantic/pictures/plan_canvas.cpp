#include "fusion/semantic/pictures/plan_canvas.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "fusion/semantic/pictures/plan_palette.hpp"
#include "fusion/semantic/pictures/png_compression.hpp"

namespace parhelion::semantic {
namespace {

constexpr int kFineness = 2;      ///< rendered pixels per pixel of the picture
constexpr int kFractionBits = 4;  ///< of OpenCV's fixed-point coordinates
constexpr int kFont = cv::FONT_HERSHEY_DUPLEX;
constexpr double kCapital = 21;  ///< height of a capital of this font at scale 1, pixels

const Colour kUnseen{229, 233, 238};
const Colour kSolid{38, 44, 54};

cv::Scalar bgr(Colour colour) { return {double(colour.blue), double(colour.green), double(colour.red)}; }

std::string ascii(const std::string& words) {
  std::string out;
  for (const char c : words) {
    const auto byte = static_cast<unsigned char>(c);
    // One '?' per non-ASCII character: its continuation bytes are dropped.
    if ((byte & 0xC0U) != 0x80) out += byte < 0x20 || byte > 0x7E ? '?' : c;
  }
  return out;
}

/// White where free, dark where solid, grey where unknown.
Colour cell_colour(float probability) {
  const double p = std::clamp(static_cast<double>(probability), 0.0, 1.0);
  const Colour& far = p < 0.5 ? palette::kPaper : kSolid;
  const double fraction = std::min(1.0, std::abs(p - 0.5) / 0.3);
  const auto mix = [fraction](std::uint8_t a, std::uint8_t b) {
    return cv::saturate_cast<std::uint8_t>(a + fraction * (b - a));
  };
  return {mix(kUnseen.red, far.red), mix(kUnseen.green, far.green), mix(kUnseen.blue, far.blue)};
}

}  // namespace

PlanCanvas::PlanCanvas(int width, const Eigen::AlignedBox2d& view, int title_bar, int legend_bar)
    : width_(width), title_bar_(title_bar), legend_bar_(legend_bar) {
  const Eigen::Vector2d size = view.sizes();
  // Limits the aspect ratio: the view is extended to between 2:5 and 5:4 of the width.
  const double aspect = std::clamp(size.y() / size.x(), 0.4, 1.25);
  const double plan_height = std::round(width * aspect);
  height_ = static_cast<int>(plan_height) + title_bar + legend_bar;
  scale_ = std::min(width / size.x(), plan_height / size.y());
  const Eigen::Vector2d half(width / scale_ / 2, plan_height / scale_ / 2);
  view_corner_ = {view.center().x() - half.x(), view.center().y() + half.y()};
  image_ = cv::Mat(height_ * kFineness, width_ * kFineness, CV_8UC3, bgr(kUnseen));
}

Eigen::Vector2d PlanCanvas::pixel(const Eigen::Vector2d& p) const {
  return {(p.x() - view_corner_.x()) * scale_, title_bar_ + (view_corner_.y() - p.y()) * scale_};
}

cv::Point PlanCanvas::fine(const Eigen::Vector2d& pixel) const {
  // Clamped: OpenCV's fixed point has 32 bits.
  const auto coordinate = [](double v) {
    return static_cast<int>(std::lround(std::clamp(v, -1e5, 1e5) * kFineness * (1 << kFractionBits)));
  };
  return {coordinate(pixel.x()), coordinate(pixel.y())};
}

void PlanCanvas::draw_map(const pose::GridMap& map) {
  std::vector<Colour> cells;
  cells.reserve(map.occupied.size());
  for (const float probability : map.occupied) cells.push_back(cell_colour(probability));
  draw_cells(cells, map.width, map.resolution, {map.x_min, map.y_min});
}

void PlanCanvas::draw_cells(const std::vector<Colour>& colours, int columns, double side,
                            const Eigen::Vector2d& low) {
  const int rows = static_cast<int>(colours.size()) / columns;
  cv::Mat cells(rows, columns, CV_8UC3);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const Colour& c = colours[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) +
                                static_cast<std::size_t>(x)];
      cells.at<cv::Vec3b>(rows - 1 - y, x) = {c.blue, c.green, c.red};
    }
  }
  const double size = side * scale_ * kFineness;  // drawn pixels per cell
  if (size < 1) {
    // Cells smaller than pixels are averaged first; sampling would lose thin walls.
    cv::resize(cells, cells, {}, size, size, cv::INTER_AREA);
  }
  const Eigen::Vector2d corner = pixel({low.x(), low.y() + rows * side}) * kFineness;
  const double step_x = columns * size / cells.cols, step_y = rows * size / cells.rows;
  // Pixel centres are at integers in OpenCV.
  const cv::Matx23d to_canvas(step_x, 0, corner.x() + step_x / 2 - 0.5, 0, step_y,
                              corner.y() + step_y / 2 - 0.5);
  cv::warpAffine(cells, image_, to_canvas, image_.size(), cv::INTER_NEAREST, cv::BORDER_TRANSPARENT);
}

void PlanCanvas::fill(const std::vector<std::vector<Eigen::Vector2d>>& polygons, Colour colour,
                      double opacity) {
  constexpr int kEdge = 2;  // pixels beyond a polygon that its smoothed edge may touch
  std::vector<std::vector<cv::Point>> drawn;
  cv::Rect around;
  for (const auto& polygon : polygons) {
    std::vector<cv::Point> corners;
    for (const Eigen::Vector2d& p : polygon) corners.push_back(fine(pixel(p)));
    if (corners.size() < 3) continue;
    around |= cv::boundingRect(corners);
    drawn.push_back(std::move(corners));
  }
  // Only this part is mixed: a canvas has tens of megabytes, and most layers are small.
  const cv::Point low((around.x >> kFractionBits) - kEdge, (around.y >> kFractionBits) - kEdge),
      high((around.br().x >> kFractionBits) + 1 + kEdge, (around.br().y >> kFractionBits) + 1 + kEdge);
  const cv::Rect part = cv::Rect(low, high) & cv::Rect({}, image_.size());
  if (drawn.empty() || part.empty()) return;
  cv::Mat under = image_(part), layer = opacity < 1 ? under.clone() : under;
  for (std::vector<cv::Point>& corners : drawn) {
    for (cv::Point& corner : corners) corner -= part.tl() * (1 << kFractionBits);
    cv::fillPoly(layer, std::vector<std::vector<cv::Point>>{corners}, bgr(colour), cv::LINE_AA,
                 kFractionBits);
  }
  if (opacity < 1) cv::addWeighted(layer, opacity, under, 1 - opacity, 0, under);
}

void PlanCanvas::line(const std::vector<Eigen::Vector2d>& points, Colour colour, double width, bool closed) {
  std::vector<cv::Point> corners;
  for (const Eigen::Vector2d& p : points) corners.push_back(fine(pixel(p)));
  const int thickness = std::max(1, static_cast<int>(std::lround(width * kFineness)));
  if (corners.size() > 1)
    cv::polylines(image_, corners, closed, bgr(colour), thickness, cv::LINE_AA, kFractionBits);
}

void PlanCanvas::disc(const Eigen::Vector2d& p, double radius, Colour colour) {
  pixel_disc(pixel(p), radius, colour);
}

void PlanCanvas::bar(const Eigen::AlignedBox2d& box, Colour colour) {
  const auto drawn = [](const Eigen::Vector2d& p) {
    return cv::Point(static_cast<int>(std::lround(p.x() * kFineness)),
                     static_cast<int>(std::lround(p.y() * kFineness)));
  };
  cv::rectangle(image_, drawn(box.min()), drawn(box.max()), bgr(colour), cv::FILLED);
}

void PlanCanvas::pixel_line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, Colour colour, double width) {
  cv::line(image_, fine(a), fine(b), bgr(colour),
           std::max(1, static_cast<int>(std::lround(width * kFineness))), cv::LINE_AA, kFractionBits);
}

void PlanCanvas::pixel_disc(const Eigen::Vector2d& p, double radius, Colour colour) {
  const int fixed = static_cast<int>(std::lround(radius * kFineness * (1 << kFractionBits)));
  cv::circle(image_, fine(p), fixed, bgr(colour), cv::FILLED, cv::LINE_AA, kFractionBits);
}

void PlanCanvas::text(const Eigen::Vector2d& p, const std::string& words, double size, Colour colour,
                      bool halo) {
  const double font_scale = size * kFineness / kCapital;
  const cv::Point at(static_cast<int>(std::lround(p.x() * kFineness)),
                     static_cast<int>(std::lround(p.y() * kFineness)));
  const int stroke = std::max(1, static_cast<int>(std::lround(font_scale * 1.6)));
  if (halo)
    cv::putText(image_, ascii(words), at, kFont, font_scale, bgr(palette::kPaper), stroke + 4 * kFineness,
                cv::LINE_AA);
  cv::putText(image_, ascii(words), at, kFont, font_scale, bgr(colour), stroke, cv::LINE_AA);
}

double PlanCanvas::text_width(const std::string& words, double size) const {
  const double font_scale = size * kFineness / kCapital;
  int baseline = 0;
  return static_cast<double>(cv::getTextSize(ascii(words), kFont, font_scale, 1, &baseline).width) /
         kFineness;
}

cv::Mat PlanCanvas::picture() const {
  cv::Mat picture;
  cv::resize(image_, picture, {width_, height_}, 0, 0, cv::INTER_AREA);
  return picture;
}

bool PlanCanvas::write(const std::string& path) const {
  return cv::imwrite(path, picture(), {cv::IMWRITE_PNG_COMPRESSION, kPngCompression});
}

}  // namespace parhelion::semantic
