// When messages arrive, compared with their stamps: the rate of a sensor's clock, and the beam of a scan
// whose instant its stamp is.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "protocols/scan.hpp"
#include "protocols/time.hpp"

namespace parhelion::tools {

/// The messages of one channel, in the order of a log.
struct Arrivals {
  std::vector<SensorTime> stamps;
  std::vector<ArrivalTime> arrivals;

  void add(SensorTime stamp, ArrivalTime arrival);
};

/// s by which stamps advance in a second of arrivals, median over spans of 2 s; 1 where there is none.
double stamp_rate(const Arrivals& messages);

/// s by which stamps of `second` are older than those of `first` in messages that arrive one after the other,
/// median; nullopt: there are none.
std::optional<double> lag_between(const Arrivals& first, const Arrivals& second);

/// How a laser's scans arrive.
struct ScanArrival {
  /// s, median over scans and the ODOMETRY that arrived before each: the scan's stamp less that of ODOMETRY.
  /// nullopt: no ODOMETRY, the log has no times of arrival but the stamps, or ODOMETRY waits for the scan,
  /// whose stamp it has.
  std::optional<double> odometry_lag;
  double delay = 0;  ///< s from its stamp to its arrival, median; by two clocks if the log has another
};
ScanArrival scan_arrival(const Arrivals& scans, const Arrivals& odometry);

/// The scans' stamps are seconds away from those of the odometry that arrives with them.
bool has_another_clock(const ScanArrival& arrival);
/// What that means, and what to do.
std::string clock_advice(double odometry_lag);

/// s by which scans arrive before their last beam is measured as the laser is described, which cannot be.
/// Judged by the clock of the log, and by the one that odometry shows, as the clocks of laser and log may
/// differ, or those of laser and odometry: odometry takes less than half a sweep to arrive, or less than 20
/// ms. nullopt: the description agrees, or the log does not show it. `beams`: of a scan whose beams have no
/// times of their own.
std::optional<double> early_arrival(const LaserDescription& laser, std::size_t beams,
                                    const ScanArrival& arrival);

/// Early by nearly a whole sweep, and by clocks that agree: the stamp is that of the arrival. What is less
/// certain may be odometry that is slow, in a log whose clock is behind.
bool is_stamped_at_arrival(const LaserDescription& laser, std::size_t beams, const ScanArrival& arrival);

/// What early_arrival() means, and what to do.
std::string stamp_beam_advice(double early);

}  // namespace parhelion::tools
