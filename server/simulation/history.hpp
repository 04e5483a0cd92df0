// The last states of all movable bodies: a ring of records, and interpolation between two of them.
#pragma once

#include <memory>
#include <vector>

#include "protocols/scene.hpp"
#include "protocols/time.hpp"
#include "protocols/world.hpp"

namespace parhelion::simulation {

class Building;

/// The results of a step.
struct HistoryRecord {
  SimulationTime stamp;
  std::uint64_t step = 0;
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const Building> building;  ///< the building at that step
  std::vector<BodyState> bodies;  ///< those that can move and exist at the stamp, and doors that have moved;
                                  ///< ascending id
};

class History {
 public:
  /// Keeps `records` records.
  explicit History(std::size_t records) : ring_(records) {}

  /// Returns the oldest record for reuse, to be filled with the coming step; it becomes the newest.
  HistoryRecord& push();
  std::size_t size() const { return size_; }
  const HistoryRecord& newest() const { return from_newest(0); }
  /// `back` records before the newest.
  const HistoryRecord& from_newest(std::size_t back) const {
    return ring_[(next_ + ring_.size() - 1 - back) % ring_.size()];
  }

  /// Poses at t, appended to `bodies`; returns the record that they start from. Between two records of one
  /// epoch positions are interpolated linearly and rotations along the shortest arc; a body that was spawned,
  /// moved or removed by the later record keeps its pose of the earlier one. After the newest, up to `ahead`,
  /// each body is extrapolated with its velocities. nullptr: outside the history.
  const HistoryRecord* find(SimulationTime t, Duration ahead, std::vector<BodyState>& bodies) const;
  /// The record at or before t, without poses.
  const HistoryRecord* record_at(SimulationTime t, Duration ahead) const;

 private:
  std::vector<HistoryRecord> ring_;
  std::size_t next_ = 0;
  std::size_t size_ = 0;
};

}  // namespace parhelion::simulation
