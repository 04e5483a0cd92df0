// ROS 1 bags record by record (http://wiki.ros.org/Bags/Format/2.0), in file order. Unlike librosbag it needs
// no index, so it reads bags that were cut off, and no count in the file decides about memory before it was
// checked.
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
  ArrivalTime received;                 ///< when the recorder got it
  std::uint64_t number = 0;             ///< in the file, from 1
  std::span<const std::uint8_t> bytes;  ///< valid until the next call
};

class BagReader {
 public:
  static Result<BagReader> open(const std::filesystem::path& path);
  BagReader(BagReader&&) noexcept;
  BagReader& operator=(BagReader&&) noexcept;
  ~BagReader();

  /// False at the end. An Error names the byte of what is damaged; reading on resumes behind it.
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
