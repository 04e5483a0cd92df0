// The lessons that trainees' pictures are taught by.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "protocols/event.hpp"

namespace parhelion::station {

/// Lessons of one kind may overlap: the scenario's and those that an instructor begins.
class CameraLessons {
 public:
  /// False: not about them.
  bool hear(const Event& event);
  double delay() const;  ///< s, the longest of those that hold
  double loss() const;   ///< share of the pictures that all of them leave out together

 private:
  std::vector<std::pair<std::string, double>> held_;  ///< kind, amount
};

}  // namespace parhelion::station
