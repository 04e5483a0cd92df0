// The search of a CorrelativeMap around an expected pose, in parts.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/pose/matching/correlative.hpp"

namespace parhelion::pose {

/// Needs the map at each call of advance(), and keeps no reference to it. What it finds does not depend on
/// the parts.
class WindowSearch {
 public:
  using Candidate = CorrelativeMap::Candidate;
  using Window = CorrelativeMap::Window;
  using Request = CorrelativeMap::Request;

  /// `points_base`: m. They are copied.
  WindowSearch(const CorrelativeMap& map, std::span<const Eigen::Vector2d> points_base, const Window& window,
               const Request& request);
  /// Evaluates about so many squares, each with all points. True: the search has ended.
  bool advance(const CorrelativeMap& map, std::size_t evaluations);
  /// Best first; final once the search has ended.
  const std::vector<Candidate>& found() const { return places_.found; }

  /// The distinct places with the highest scores so far.
  struct Places {
    Request request;
    std::vector<Candidate> found;

    /// A lower score, or this one, is of no use.
    double bound() const;
    void take(const Candidate& candidate);
  };

 private:
  using Offset = CorrelativeMap::Offset;
  /// At one heading; `score`: an upper bound of the scores within.
  struct Square {
    std::size_t yaw;
    Offset shift;
    int level;
    double score;
  };
  std::size_t cover(const CorrelativeMap& map);
  std::size_t branch(const CorrelativeMap& map, const Square& square);

  Window window_;
  Places places_;
  std::vector<Eigen::Vector2d> points_;
  int reach_x_, reach_y_;  ///< cells
  int top_ = 0;            ///< level that the search begins with
  std::vector<double> yaws_;
  std::vector<std::vector<Offset>> turned_;  ///< the points' cells at each heading that is covered so far
  std::vector<Square> roots_;                ///< once all headings are covered: best first
  std::size_t next_root_ = 0;
  std::vector<Square> open_;  ///< best last
};

}  // namespace parhelion::pose
