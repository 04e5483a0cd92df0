// The messages of a ROS recording, one after the other, whatever its format.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "protocols/status.hpp"
#include "protocols/time.hpp"
#include "tools/import/ros_message.hpp"

namespace parhelion::tools {

struct BagMessage {
  std::string topic;
  std::string type;          ///< "sensor_msgs/LaserScan", of ROS 2, too
  ArrivalTime received;      ///< receive time of the recorder
  std::uint64_t number = 0;  ///< in the recording, from 1
  ros::MessageBytes bytes;   ///< valid until the next call
};

class BagSource {
 public:
  virtual ~BagSource() = default;
  /// False at the end. After an error, which says where the damage is, it may be called again: it goes on
  /// behind the damage, or ends.
  virtual Result<bool> next(BagMessage& message) = 0;
  virtual std::uint64_t messages() const = 0;  ///< read so far
  virtual double done() const = 0;             ///< bytes, about
  virtual double total() const = 0;            ///< bytes

 protected:
  BagSource() = default;
  BagSource(const BagSource&) = default;
  BagSource& operator=(const BagSource&) = default;
  BagSource(BagSource&&) = default;
  BagSource& operator=(BagSource&&) = default;
};

/// A ROS 1 bag; or of ROS 2 a folder with metadata.yaml, a .db3 or .mcap file, or either compressed with
/// zstd. The files of a folder are read one after the other. Error: not readable, or a file that
/// metadata.yaml lists is missing.
Result<std::unique_ptr<BagSource>> open_bag(const std::filesystem::path& path);

/// By content: what open_bag() reads. A folder is one if it has rosbag2's metadata.yaml, or recordings.
bool is_bag(const std::filesystem::path& path);

}  // namespace parhelion::tools
