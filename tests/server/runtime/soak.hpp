// The same drive repeated as one long session: memory and scan latency must stay constant.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <vector>

#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/runtime/outbox.hpp"
#include "server/runtime/report.hpp"
#include "server/tick/tick.hpp"

namespace parhelion::test {

/// Resident memory of this process, MB.
inline double resident() {
  std::ifstream statm("/proc/self/statm");
  double size = 0, pages = 0;
  statm >> size >> pages;
  return pages * 4096 / 1e6;
}

/// Laps of a drive: stamps continue, and odometry continues from the end of the previous lap.
class Laps {
 public:
  /// `lap`: the inputs of one lap, by arrival; `pause`: from its last input to the next lap's first.
  Laps(std::vector<Message> lap, Duration pause) : lap_(std::move(lap)) {
    length_ = lap_.back().arrival - lap_.front().arrival + pause;
    std::vector<Transform<Odom, Base>> poses;
    for (const Message& each : lap_) {
      Odometry odometry;
      if (each.channel == channel::kOdometry && decode(each.channel, each.payload, odometry))
        poses.push_back(odometry.T_odom_base);
    }
    if (!poses.empty()) once_round_ = poses.back().isometry() * poses.front().isometry().inverse();
  }
  Duration length() const { return length_; }
  const std::vector<Message>& first() const { return lap_; }
  /// Call for ascending laps, from 0.
  std::vector<Message> lap(int number) {
    if (number > 0) round_ = once_round_ * round_;
    std::vector<Message> shifted = lap_;
    const Duration by{length_.ns * number};
    for (Message& each : shifted) {
      each.arrival = each.arrival + by;
      if (each.channel == channel::kScan) shift<Scan>(each, by);
      if (each.channel == channel::kPoseCov) shift<PoseEstimate>(each, by);
      if (each.channel == channel::kOdometry) {
        shift<Odometry>(each, by, [this](Odometry& odometry) {
          odometry.T_odom_base = Transform<Odom, Base>(round_ * odometry.T_odom_base.isometry());
        });
      }
    }
    return shifted;
  }

 private:
  template <class T>
  static void shift(Message& message, Duration by, auto change) {
    T item;
    ASSERT_TRUE(decode(message.channel, message.payload, item).ok());
    item.stamp = item.stamp + by;
    change(item);
    encode(item, message.payload);
  }
  template <class T>
  static void shift(Message& message, Duration by) {
    shift<T>(message, by, [](T&) {});
  }

  std::vector<Message> lap_;
  Duration length_;
  Eigen::Isometry3d once_round_ = Eigen::Isometry3d::Identity(), round_ = Eigen::Isometry3d::Identity();
};

/// Runs for `log_time`, in `parts`; prints memory and the scans' p99 after each. Memory must not grow after
/// the first quarter; times are only printed.
inline void soak(const tick::Configuration& configuration, Laps laps, Duration log_time, int parts) {
  auto made = tick::make_state(configuration, laps.first().front().arrival - milliseconds(1));
  ASSERT_TRUE(made.ok()) << made.error().message;
  tick::State& state = **made;
  runtime::Outbox outbox(nullptr, std::nullopt);
  tick::Outputs outputs;
  const int count = std::max(parts, static_cast<int>(log_time.seconds() / laps.length().seconds()));
  [[maybe_unused]] double after_warm_up = 0;
  int lap = 0;
  for (int part = 0; part < parts; ++part) {
    runtime::StageClock stages;
    for (; lap < count * (part + 1) / parts; ++lap) {
      for (const Message& each : laps.lap(lap)) {
        outputs.clear();
        stages.begin();
        tick::tick(configuration, each, state, outputs, stages);
        outbox.send(&each, outputs.entries(), each.arrival);
      }
    }
    const double memory = resident();
    if (part == parts / 4) after_warm_up = memory;
    std::printf("%6.2f h of log time: memory %.1f MB, scan p50 %.0f p99 %.0f max %.0f us (%llu scans)\n",
                lap * laps.length().seconds() / 3600, memory, stages.scan_us.at(0.5), stages.scan_us.at(0.99),
                stages.scan_us.max(), static_cast<unsigned long long>(stages.scan_us.count()));
    std::fflush(stdout);
  }
  const auto scans =
      static_cast<std::uint64_t>(std::count_if(laps.first().begin(), laps.first().end(),
                                               [](const Message& m) { return m.channel == channel::kScan; }));
  EXPECT_EQ(state.tally.scans_in, scans * static_cast<std::uint64_t>(count));
  EXPECT_EQ(state.tally.scans_out, state.tally.scans_in);
  EXPECT_EQ(state.tally.refused_inputs, 0U) << state.tally.last_refusal;
  EXPECT_GT(state.tally.beams_replaced, 0U);
#ifndef PARHELION_ADDRESS_SANITIZER  // its quarantine keeps freed memory
  EXPECT_LT(resident(), after_warm_up + 4) << "MB";
#endif
}

}  // namespace parhelion::test
