// A drawing surface in map coordinates, drawn at twice the resolution and then reduced for smooth edges.
// Internal to plan_picture*.cpp, the only files of this module that name OpenCV.
#pragma once

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "fusion/pose/maps/grid_map.hpp"
#include "fusion/semantic/pictures/plan_picture.hpp"

namespace parhelion::semantic {

class PlanCanvas {
 public:
  /// A picture of `width` pixels that shows `view` (m, map frame) between bars for title (above) and legend
  /// (below).
  PlanCanvas(int width, const Eigen::AlignedBox2d& view, int title_bar, int legend_bar);

  double pixels_per_metre() const { return scale_; }
  int width() const { return width_; }
  int height() const { return height_; }
  int title_bar() const { return title_bar_; }
  int plan_bottom() const { return height_ - legend_bar_; }

  /// Map frame to pixels of the picture.
  Eigen::Vector2d pixel(const Eigen::Vector2d& p) const;

  void draw_map(const pose::GridMap& map);
  /// Cells with sides of `side` metres in rows of `columns`, lowest row first, from `low` (map frame).
  void draw_cells(const std::vector<Colour>& cells, int columns, double side, const Eigen::Vector2d& low);
  /// Fills polygons (map frame) with one translucent layer of colour.
  void fill(const std::vector<std::vector<Eigen::Vector2d>>& polygons, Colour colour, double opacity);
  /// Line through points of the map frame; `width` in pixels.
  void line(const std::vector<Eigen::Vector2d>& points, Colour colour, double width, bool closed = false);
  /// Disc at a point of the map frame; radius in pixels.
  void disc(const Eigen::Vector2d& p, double radius, Colour colour);

  // In pixels of the picture:
  void bar(const Eigen::AlignedBox2d& box, Colour colour);
  void pixel_line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, Colour colour, double width);
  void pixel_disc(const Eigen::Vector2d& p, double radius, Colour colour);
  /// Left end of the baseline at `p`; `size`: height of a capital in pixels. A halo keeps the text readable
  /// on any background.
  void text(const Eigen::Vector2d& p, const std::string& words, double size, Colour colour,
            bool halo = false);
  double text_width(const std::string& words, double size) const;

  /// What is drawn, at the picture's own size: BGR, 8 bits.
  cv::Mat picture() const;
  /// Writes it as PNG; false where it cannot be written.
  bool write(const std::string& path) const;

 private:
  cv::Point fine(const Eigen::Vector2d& pixel) const;
  int width_, height_, title_bar_, legend_bar_;
  double scale_;
  Eigen::Vector2d view_corner_;  ///< m, of the plan's upper left corner
  cv::Mat image_;
};

}  // namespace parhelion::semantic
