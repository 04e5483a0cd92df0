// LCM logs that a test writes.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "protocols/bus/log_file.hpp"
#include "protocols/codec.hpp"
#include "protocols/robot.hpp"

namespace parhelion::test {

/// A log that starts with the description of its robot. Each message arrives 1 us after the one before.
class RobotLog {
 public:
  RobotLog(const std::string& path, const RobotDescription& robot) : writer_(LogWriter::create(path, true)) {
    write("ROBOT", RobotMessage{SensorTime::from_utime(1'000'000), to_yaml(robot)});
  }
  void write(const char* channel, const auto& message) {
    ASSERT_TRUE(writer_.ok()) << writer_.error().message;
    std::vector<std::uint8_t> bytes;
    encode(message, bytes);
    ASSERT_TRUE(writer_->write(channel, ArrivalTime::from_utime(++arrival_), bytes).ok());
  }

 private:
  Result<LogWriter> writer_;
  std::int64_t arrival_ = 1'000'000;
};

}  // namespace parhelion::test
