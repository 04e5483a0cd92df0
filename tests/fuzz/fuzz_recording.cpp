// The readers of other systems' recordings on hostile bytes: ROS 1 bags, MCAP, ROS messages, and lines of
// CARMEN logs. They end, and every error says something.
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tests/fuzz/memory_file.hpp"
#include "tools/import/carmen_line.hpp"
#include "tools/import/mcap_reader.hpp"
#include "tools/import/ros_message.hpp"
#include "tools/import/rosbag_reader.hpp"

namespace {

using parhelion::tools::BagMessage;
using parhelion::tools::BagSource;
namespace ros = parhelion::tools::ros;

template <class T>
void check(const parhelion::Result<T>& result) {
  if (!result && result.error().message.empty()) std::abort();
}

void read_message(std::uint8_t kind, const ros::MessageBytes& bytes) {
  switch (kind % 11) {
    case 0:
      return check(ros::read_string(bytes));
    case 1:
      return check(ros::read_laser_scan(bytes));
    case 2:
      return check(ros::read_image(bytes));
    case 3:
      return check(ros::read_compressed_image(bytes));
    case 4:
      return check(ros::read_camera_info(bytes));
    case 5:
      return check(ros::read_pose_stamped(bytes));
    case 6:
      return check(ros::read_odometry(bytes));
    case 7:
      return check(ros::read_tf(bytes));
    case 8:
      return check(ros::read_twist_stamped(bytes));
    case 9:
      return check(ros::read_imu(bytes));
    default:
      return check(ros::read_joint_state(bytes));
  }
}

/// Damage is reported as often as it is met, and reading goes on behind it: each call has to get on by a
/// byte, or end.
void read_all(BagSource& source, std::size_t size) {
  BagMessage message;
  for (std::size_t calls = 0; calls <= 2 * size + 16; ++calls) {
    const auto more = source.next(message);
    check(more);
    if (more && !*more) return;
    if (!more) continue;
    std::uint64_t sum = 0;
    for (const std::uint8_t byte : message.bytes.bytes) sum += byte;
    if (sum == ~std::uint64_t{0}) std::abort();  // reads all bytes: they have to be the message's own
  }
  std::abort();
}

std::vector<std::uint8_t> with_magic(std::string_view magic, const std::uint8_t* data, std::size_t size) {
  std::vector<std::uint8_t> file(magic.begin(), magic.end());
  file.insert(file.end(), data, data + size);
  return file;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const parhelion::fuzz::MemoryFile file;
  if (size < 2) return 0;
  const std::uint8_t* rest = data + 2;
  const std::size_t left = size - 2;
  switch (data[0] % 4) {
    case 0: {
      auto bag = parhelion::tools::BagReader::open(file.hold(with_magic("#ROSBAG V2.0\n", rest, left)));
      check(bag);
      if (bag) read_all(*bag, size);
      return 0;
    }
    case 1: {
      auto mcap = parhelion::tools::open_mcap(file.hold(with_magic("\x89MCAP0\r\n", rest, left)));
      check(mcap);
      if (mcap) read_all(**mcap, size);
      return 0;
    }
    case 2:
      read_message(data[1], {{rest, left}, (data[1] & 0x80) != 0 ? ros::Encoding::cdr : ros::Encoding::ros1});
      return 0;
    default: {
      bool damaged = false;
      check(parhelion::tools::parse_carmen_line(std::string_view(reinterpret_cast<const char*>(rest), left),
                                                damaged));
      return 0;
    }
  }
}
