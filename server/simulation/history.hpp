// The last states of all bodies that can move: a ring of records, and the world between two of them.
#pragma once

#include <memory>
#include <vector>

#include "protocols/scene.hpp"
#include "protocols/time.hpp"
#include "protocols/world.hpp"

namespace parhelion::simulation {

class Building;

/// All that a step made.
struct HistoryRecord {
  SimulationTime stamp;
  std::uint64_t step = 0;
  bool attitude_known = false;  ///< of the real robot
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const Building> building;  ///< what stood then
  std::vector<BodyState> bodies;  ///< those that can move and exist at the stamp, and doors that have moved;
                                  ///< ascending id
};

class History {
 public:
  /// Keeps `records` of them.
  explicit History(std::size_t records) : ring_(records) {}

  /// The oldest record's memory, to be filled with the coming step; it then is the newest.
  HistoryRecord& push();
  std::size_t size() const { return size_; }
  const HistoryRecord& newest() const { return from_newest(0); }
  /// `back` records before the newest.
  const HistoryRecord& from_newest(std::size_t back) const {
    return ring_[(next_ + ring_.size() - 1 - back) % ring_.size()];
  }

  /// Poses at t, appended to `bodies` with the record that they start from: between two records of one epoch
  /// positions go linearly and rotations along the shortest arc; a body that was spawned, moved or removed by
  /// the later record stays as the earlier one has it. After the newest, up to `ahead`, each body goes on
  /// with its velocities. nullptr: outside.
  const HistoryRecord* find(SimulationTime t, Duration ahead, std::vector<BodyState>& bodies) const;
  /// The record at or before t, without poses.
  const HistoryRecord* record_at(SimulationTime t, Duration ahead) const;

 private:
  std::vector<HistoryRecord> ring_;
  std::size_t next_ = 0;
  std::size_t size_ = 0;
};

}  // namespace parhelion::simulation
