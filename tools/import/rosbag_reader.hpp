// Reads ROS 1 bags record by record (http://wiki.ros.org/Bags/Format/2.0), in file order. Unlike librosbag it
// needs no index, so it reads truncated bags, and it checks every count in the file before allocating memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "protocols/status.hpp"
#include "protocols/time.hpp"

namespace parhelion::tools {

struct BagMessage {
  std::string topic;
  std::string type;                     ///< "sensor_msgs/LaserScan"
  ArrivalTime received;                 ///< receive time of the recorder
  std::uint64_t number = 0;             ///< in the file, from 1
  std::span<const std::uint8_t> bytes;  ///< valid until the next call
};

class BagReader {
 public:
  static Result<BagReader> open(const std::filesystem::path& path);
  BagReader(BagReader&&) noexcept;
  BagReader& operator=(BagReader&&) noexcept;
  ~BagReader();

  /// False at the end. The error contains the offset of the damage; reading resumes behind it.
  Result<bool> next(BagMessage& message);
  std::uint64_t messages() const;  ///< read so far
  double done() const;
  double total() const;

 private:
  struct State;
  explicit BagReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::tools
