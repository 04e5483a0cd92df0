// Where in an old part of the map the scans along some metres of path fit, if there is just one such place.
// Along a corridor a single scan fits at many: doors repeat, and what counts is what does not fit.
#pragma once

#include <optional>
#include <vector>

#include "fusion/pose/mapping/loop_search.hpp"
#include "fusion/pose/matching/window_search.hpp"

namespace parhelion::pose {

class LoopComparison {
 public:
  /// `index`: of the submap. `scans`: keyframes in the order of the path; with fewer than three nothing is
  /// found. `window`: m, the error of their expected poses.
  LoopComparison(std::size_t index, std::vector<std::size_t> scans, double window);

  /// A part of the work, half a millisecond or so. True: that was the last. Until then keyframes must keep
  /// their poses.
  bool step(const LoopSearch& search, Submap& submap);
  /// The scans, matched to the submap, after the last part. Empty: they fit nowhere, or at another place
  /// nearly as well, or too far from where they are expected while they fit nearer to it.
  std::vector<Closure>& closures() { return closures_; }

  std::size_t submap() const { return index_; }

 private:
  /// One scan, matched to the surroundings.
  struct ScanFit {
    Pose2 correction;
    double cost = 0;
    double explained = 0;  ///< fraction of the points that lie where the map was seen; 0: too few do
    bool seen = false;     ///< enough of them do
  };
  /// A correction that the scans may have in common.
  struct Hypothesis {
    Pose2 correction;
    std::size_t scans = 0;      ///< that it explains
    double explained = 0;       ///< mean of all scans, of ScanFit::explained
    double cost = 0;            ///< of all scans, and of the correction
    std::vector<ScanFit> fits;  ///< of the scans, in their order
  };
  void begin_search(const LoopSearch& search, const Submap& submap);
  bool search_places(const LoopSearch& search, const Submap& submap);
  ScanFit fit(const LoopSearch& search, const Submap& submap, std::size_t keyframe,
              const Pose2& correction) const;
  void judge(const LoopSearch& search, const Submap& submap, Hypothesis& hypothesis) const;
  bool is_enough(const LoopSearch& search, const Hypothesis& best) const;
  bool fits_too(const Hypothesis& other, const Hypothesis& best) const;
  bool is_rivalled(const LoopSearch& search, const Hypothesis& best) const;
  std::optional<Pose2> only_correction(const LoopSearch& search) const;
  bool match_scans(const LoopSearch& search, Submap& submap);
  /// m, by how far a correction moves the scans.
  double moved(const LoopSearch& search, const Pose2& correction) const;
  bool is_same(const LoopSearch& search, const Pose2& a, const Pose2& b, double distance) const;

  std::size_t index_;
  std::vector<std::size_t> scans_;
  std::size_t middle_;  ///< keyframe
  double window_;
  std::vector<Hypothesis> hypotheses_;
  std::optional<WindowSearch> places_;
  std::size_t judged_ = 0;  ///< hypotheses
  std::optional<Pose2> correction_;
  std::size_t matched_ = 0;  ///< scans
  std::vector<Closure> closures_;
};

}  // namespace parhelion::pose
