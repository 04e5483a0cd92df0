// Camera faults of the training that are applied to the trainee's video.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "protocols/event.hpp"

namespace parhelion::station {

/// Faults of one kind may overlap: those of the scenario and those that an instructor starts.
class CameraFaults {
 public:
  /// False: the event concerns no camera fault.
  bool handle(const Event& event);
  double delay() const;  ///< s, maximum of the active faults
  double loss() const;   ///< fraction of the pictures that all active faults drop together

 private:
  std::vector<std::pair<std::string, double>> held_;  ///< kind, amount
};

}  // namespace parhelion::station
