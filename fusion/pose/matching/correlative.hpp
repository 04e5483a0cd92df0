// Matches a scan to a map without a good initial guess: branch and bound over a likelihood grid and its
// maxima over ever larger squares (Olson 2009; Hess et al. 2016, section V).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "protocols/pose2.hpp"

namespace parhelion::pose {

class CorrelativeMap {
 public:
  static constexpr double kSigmaCells = 1.2;
  /// `resolution`: m, of the grid and of the search. `sigma_cells`: of a point's likelihood.
  CorrelativeMap(std::span<const Eigen::Vector2d> points_map, double resolution, int levels = 7,
                 double sigma_cells = kSigmaCells);

  /// Without what searches need above the finest level, which complete() makes: half of the work each.
  static CorrelativeMap begun(std::span<const Eigen::Vector2d> points_map, double resolution, int levels);
  bool is_complete() const { return grids_.size() >= static_cast<std::size_t>(levels_); }
  void complete();

  struct Window {
    Pose2 centre;
    double reach_x = 0, reach_y = 0;  ///< m, half sides
    double angle = 0;                 ///< rad, half
  };
  struct Candidate {
    Pose2 T_map_base;
    double score = 0;  ///< 0..1, mean likelihood of the points
  };
  struct Request {
    double min_score = 0.5;
    std::size_t count = 1;        ///< maximum number of distinct results
    double distinct = 1.0;        ///< m, results nearer than this (and `distinct_angle`) count as one
    double distinct_angle = 0.5;  ///< rad
  };
  /// Best first.
  std::vector<Candidate> search(std::span<const Eigen::Vector2d> points_base, const Window& window,
                                const Request& request) const;
  /// The same by exhaustive search; for tests.
  std::vector<Candidate> search_slow(std::span<const Eigen::Vector2d> points_base, const Window& window,
                                     const Request& request) const;
  /// Mean likelihood of the points, 0..1.
  double score(std::span<const Eigen::Vector2d> points_base, const Pose2& T_map_base) const;
  /// One of the map's points lies in the cell of p.
  bool has_point(const Eigen::Vector2d& p_map) const;
  double resolution() const { return resolution_; }

 private:
  struct Finest {
    double sigma_cells;
  };
  CorrelativeMap(std::span<const Eigen::Vector2d> points_map, double resolution, int levels, Finest finest);
  friend class CorrelativeSearch;
  friend class WindowSearch;
  struct Offset {
    int x, y;
  };
  double score(const std::vector<Offset>& cells, Offset shift, int level) const;
  std::vector<Offset> rotated(std::span<const Eigen::Vector2d> points, double yaw, const Pose2& centre) const;
  std::vector<double> yaws(std::span<const Eigen::Vector2d> points, const Window& window) const;

  double resolution_;
  double x_min_ = 0, y_min_ = 0;
  int width_ = 0, height_ = 0, levels_;
  std::vector<std::vector<std::uint8_t>>
      grids_;  ///< level h: maximum over the 2^h x 2^h cells that start at each cell
};

}  // namespace parhelion::pose
