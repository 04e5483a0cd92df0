// Where on a map a scan may have been taken, without any guess: branch and bound as in CorrelativeMap, in
// slices of bounded work and with bounded memory, so that a robot that is lost still gets an answer for each
// scan.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/pose/matching/correlative.hpp"

namespace parhelion::pose {

/// Deterministic. Needs the map at each call of advance(), and keeps no reference to it. Allocates only in
/// its first search.
class CorrelativeSearch {
 public:
  using Candidate = CorrelativeMap::Candidate;

  struct Request {
    double min_score = 0.45;
    double spread = 0.2;          ///< candidates that score less than the best one by more are not listed
    std::size_t count = 64;       ///< maximum number of distinct candidates
    double distinct = 0.8;        ///< m, candidates nearer than this (and `distinct_angle`) count as one
    double distinct_angle = 0.4;  ///< rad
    std::size_t max_roots = 1U << 16U;        ///< squares that are remembered
    std::size_t max_evaluations = 4'000'000;  ///< of one search; then it ends incomplete
  };

  /// `points_base`: m, base_link. They are copied.
  void begin(const CorrelativeMap& map, std::span<const Eigen::Vector2d> points_base, const Request& request);
  /// Evaluates at most `evaluations` squares. True: the search has ended.
  bool advance(const CorrelativeMap& map, std::size_t evaluations);

  /// Best first; final once the search has ended.
  std::span<const Candidate> found() const { return found_; }
  /// No place scores more than this but those in found() and their neighbours; known at the end.
  double unlisted() const { return unlisted_; }
  /// Squares evaluated since begin(), each with all points.
  std::size_t evaluations() const { return evaluations_; }
  bool ended() const { return stage_ == Stage::ended; }

 private:
  enum class Stage : std::uint8_t { covering, descending, ended };
  using Offset = CorrelativeMap::Offset;
  /// A square of the level's size at one heading; `bound` is an upper bound of the score within, times 255.
  struct Square {
    std::uint16_t bound, yaw;
    std::int32_t level;
    std::int32_t x, y;  ///< cells from the map's corner, of the lowest position of the base
  };
  static bool is_worse(const Square& a, const Square& b);

  bool cover(const CorrelativeMap& map, std::size_t& budget);
  void descend(const CorrelativeMap& map, std::size_t& budget);
  void branch(const CorrelativeMap& map, const Square& square, std::size_t& budget);
  void turn(const CorrelativeMap& map, std::uint16_t yaw);
  void drop_worse_half();
  std::uint16_t bound_of(const CorrelativeMap& map, int x, int y, int level);
  double needed() const;
  void take(const CorrelativeMap& map, const Square& square);

  Request request_;
  Stage stage_ = Stage::ended;
  std::vector<Eigen::Vector2d> points_;  ///< base_link
  std::vector<Offset> turned_;           ///< cells, for the heading `turned_to_`
  int turned_to_ = -1, yaws_ = 0, top_ = 0;
  int next_yaw_ = 0, next_x_ = 0, next_y_ = 0;  ///< of covering
  std::vector<Square> roots_;                   ///< a heap, once the map is covered
  std::vector<Square> open_;                    ///< best last
  std::vector<Candidate> found_;
  double unlisted_ = 0;
  std::size_t evaluations_ = 0;
};

}  // namespace parhelion::pose
