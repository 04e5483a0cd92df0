// Samples ordered by stamp in a fixed number of slots; the oldest is overwritten.
#pragma once

#include <cstddef>
#include <vector>

#include "protocols/time.hpp"

namespace parhelion::pose {

template <class T>
class Ring {
 public:
  explicit Ring(std::size_t slots) : slots_(slots) {}

  std::size_t count() const { return count_; }
  /// The newest sample has age 0.
  const T& newest(std::size_t age = 0) const {
    return slots_[(next_ + 2 * slots_.size() - 1 - age) % slots_.size()];
  }
  void push(const T& sample) {
    slots_[next_] = sample;
    next_ = (next_ + 1) % slots_.size();
    if (count_ < slots_.size()) ++count_;
  }
  void clear() { count_ = 0; }
  /// Age of the newest sample with stamp <= t; count() where there is none.
  std::size_t age_at(SensorTime t) const {
    std::size_t low = 0, high = count_;
    while (low < high) {
      const std::size_t middle = low + (high - low) / 2;
      if (newest(middle).stamp <= t) {
        high = middle;
      } else {
        low = middle + 1;
      }
    }
    return low;
  }

 private:
  std::vector<T> slots_;
  std::size_t count_ = 0;
  std::size_t next_ = 0;
};

}  // namespace parhelion::pose
