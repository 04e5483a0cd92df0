#include "tests/fusion/people/recorded_people.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>

#include "tests/temporary_folder.hpp"
#include "tools/import/ros_message.hpp"
#include "tools/import/rosbag_reader.hpp"

namespace parhelion::test {
namespace {

template <class T>
T read_at(std::span<const std::uint8_t> bytes, std::size_t offset) {
  T value{};
  if (offset + sizeof(T) <= bytes.size()) std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

std::vector<std::uint8_t> file_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The first file of a zip (APPNOTE 4.3: local header, then deflated bytes).
void unpack(const std::filesystem::path& zip, const std::filesystem::path& to) {
  const std::vector<std::uint8_t> bytes = file_bytes(zip);
  const std::size_t start = 30U + read_at<std::uint16_t>(bytes, 26) + read_at<std::uint16_t>(bytes, 28);
  z_stream stream{};
  ASSERT_EQ(inflateInit2(&stream, -MAX_WBITS), Z_OK);
  stream.next_in = const_cast<Bytef*>(bytes.data() + start);
  stream.avail_in = static_cast<uInt>(bytes.size() - start);
  std::ofstream file(to, std::ios::binary);
  std::vector<char> out(1 << 20);
  int state = Z_OK;
  while (state == Z_OK) {
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    state = inflate(&stream, Z_NO_FLUSH);
    file.write(out.data(), static_cast<std::streamsize>(out.size() - stream.avail_out));
  }
  inflateEnd(&stream);
  ASSERT_EQ(state, Z_STREAM_END) << zip;
}

/// Calls handle(message) for every message.
template <class Handle>
void read_bag(const std::filesystem::path& path, Handle&& handle) {
  TemporaryFolder folder;
  std::filesystem::path bag = path;
  if (path.extension() == ".zip") unpack(path, bag = folder / "unpacked.bag");
  auto reader = tools::BagReader::open(bag);
  ASSERT_TRUE(reader) << reader.error().message;
  tools::BagMessage message;
  for (;;) {
    const auto more = reader.value().next(message);
    if (more && !more.value()) return;
    if (more) handle(message);
  }
}

void describe(const tools::ros::LaserScan& message, LaserDescription& laser) {
  laser.convention.range_min = message.range_min;
  laser.convention.range_max = message.range_max;
  laser.noise_sigma = 0.01;
  laser.beams = static_cast<int>(message.ranges.size());
  laser.scan_period = message.scan_time > 0 ? double{message.scan_time} : 0.1;
}

LabelledScan labelled_scan(const tools::ros::LaserScan& message) {
  LabelledScan out;
  out.stamp = SimulationTime{message.header.stamp.ns};
  out.scan.stamp = message.header.stamp;
  out.scan.ranges = message.ranges;
  out.scan.angle_min = message.angle_min;
  out.scan.angle_increment = message.angle_increment;
  // Error codes of a Hokuyo, in mm: nothing was measured.
  for (float& range : out.scan.ranges)
    if (range < 0.02F) range = std::numeric_limits<float>::infinity();
  return out;
}

std::vector<Eigen::Vector2d> positions(std::span<const std::uint8_t> bytes) {
  const std::size_t frame = read_at<std::uint32_t>(bytes, 12);
  const std::size_t start = 16 + frame, count = read_at<std::uint32_t>(bytes, start);
  std::vector<Eigen::Vector2d> all;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = start + 4 + i * 56;
    all.emplace_back(read_at<double>(bytes, at), read_at<double>(bytes, at + 8));
  }
  return all;
}

/// The labels have no identities: who is near a person of the scan before is that person.
class LabelIdentities {
 public:
  void assign(SimulationTime stamp, std::vector<KnownPerson>& people) {
    std::vector<char> used(known_.size(), 0);
    for (KnownPerson& person : people) {
      std::size_t best = known_.size();
      double nearest = kStep;
      for (std::size_t i = 0; i < used.size(); ++i) {
        const double distance = (known_[i].position - person.position).norm();
        if (used[i] != 0 || stamp - known_[i].seen > kMemory || distance >= nearest) continue;
        nearest = distance;
        best = i;
      }
      if (best == known_.size()) known_.push_back({person.position, stamp});
      if (best < used.size()) used[best] = 1;
      known_[best] = {person.position, stamp};
      person.id = static_cast<int>(best);
    }
  }

 private:
  static constexpr double kStep = 0.7;  // m between two labels of one person
  static constexpr Duration kMemory = seconds(2.0);
  struct Known {
    Eigen::Vector2d position;
    SimulationTime seen;
  };
  std::vector<Known> known_;
};

Pose2 pose_at(const std::map<std::int64_t, Pose2>& poses, std::int64_t ns) {
  if (poses.empty()) return {};
  const auto after = poses.lower_bound(ns);
  if (after == poses.begin()) return after->second;
  if (after == poses.end()) return std::prev(after)->second;
  const auto before = std::prev(after);
  return interpolate(
      before->second, after->second,
      static_cast<double>(ns - before->first) / static_cast<double>(after->first - before->first));
}

}  // namespace

Recording read_benchmark(const std::filesystem::path& path) {
  Recording recording;
  std::map<std::int64_t, std::size_t> scan_received;
  std::map<std::int64_t, std::vector<KnownPerson>> labels;
  std::map<std::int64_t, Pose2> odometry;
  read_bag(path, [&](const tools::BagMessage& message) {
    if (message.type == "sensor_msgs/LaserScan") {
      const auto scan = tools::ros::read_laser_scan(message.bytes);
      if (!scan) return;
      describe(scan.value(), recording.laser);
      scan_received[message.received.ns] = recording.scans.size();
      recording.scans.push_back(labelled_scan(scan.value()));
    } else if (message.type == "leg_tracker/Person") {
      labels[message.received.ns].push_back(
          {static_cast<int>(read_at<std::uint32_t>(message.bytes.bytes, 56)),
           {read_at<double>(message.bytes.bytes, 0), read_at<double>(message.bytes.bytes, 8)},
           true});
    } else if (message.type == "nav_msgs/Odometry") {
      const auto read = tools::ros::read_odometry(message.bytes);
      if (!read) return;
      const Eigen::Isometry3d& pose = read.value().pose;
      odometry[read.value().header.stamp.ns] = {pose.translation().x(), pose.translation().y(),
                                                std::atan2(pose(1, 0), pose(0, 0))};
    }
  });
  // The mounting of the wheelchair's laser, as its bag's tf has it.
  const Pose2 T_base_laser = odometry.empty() ? Pose2{} : Pose2{0.85, 0.235, 2 * std::atan2(0.359, 0.933)};
  for (LabelledScan& scan : recording.scans)
    scan.T_map_laser = pose_at(odometry, scan.stamp.ns) * T_base_laser;
  for (const auto& [received, people] : labels) {
    auto next = scan_received.lower_bound(received);
    if (next == scan_received.end() ||
        (next != scan_received.begin() && received - std::prev(next)->first < next->first - received))
      --next;
    LabelledScan& scan = recording.scans[next->second];
    scan.labelled = true;
    scan.people.insert(scan.people.end(), people.begin(), people.end());
  }
  return recording;
}

Recording read_legs(const std::filesystem::path& scans, const std::filesystem::path& extracted) {
  Recording recording;
  recording.complete = true;
  recording.sector = 15 * 3.14159265358979 / 180;
  recording.reach = 5;
  // The clusters have no stamp: the n-th belong to the n-th scan.
  std::vector<std::int64_t> stamps;
  std::vector<std::vector<Eigen::Vector2d>> clusters;
  read_bag(extracted, [&](const tools::BagMessage& message) {
    if (message.type == "geometry_msgs/PoseArray") clusters.push_back(positions(message.bytes.bytes));
    if (message.type != "sensor_msgs/LaserScan") return;
    if (const auto scan = tools::ros::read_laser_scan(message.bytes))
      stamps.push_back(scan.value().header.stamp.ns);
  });
  std::map<std::int64_t, std::vector<Eigen::Vector2d>> legs;
  for (std::size_t i = 0; i < std::min(stamps.size(), clusters.size()); ++i) legs[stamps[i]] = clusters[i];
  LabelIdentities identities;
  read_bag(scans, [&](const tools::BagMessage& message) {
    if (message.type != "sensor_msgs/LaserScan") return;
    const auto scan = tools::ros::read_laser_scan(message.bytes);
    if (!scan) return;
    describe(scan.value(), recording.laser);
    LabelledScan out = labelled_scan(scan.value());
    const auto found = legs.find(out.stamp.ns);
    out.labelled = found != legs.end();
    if (out.labelled) {
      std::vector<Eigen::Vector2d> left = found->second;
      while (!left.empty()) {
        Eigen::Vector2d first = left.back();
        left.pop_back();
        const auto second = std::min_element(left.begin(), left.end(), [&](const auto& a, const auto& b) {
          return (a - first).norm() < (b - first).norm();
        });
        if (second != left.end() && (*second - first).norm() < 0.8) {
          first = (first + *second) / 2;
          left.erase(second);
        }
        out.people.push_back({0, first, true});
      }
      identities.assign(out.stamp, out.people);
    }
    recording.scans.push_back(std::move(out));
  });
  return recording;
}

PeopleScore score(const Recording& recording, const people::PeopleOptions& options) {
  PeopleScore result;
  people::PeopleTracker tracker(options);
  SimulationTime before{};
  for (const LabelledScan& each : recording.scans) {
    const auto T_map_laser = transform<Map, Laser>(each.T_map_laser).moved_by({0, 0, 0.3});
    const std::vector<float> time(each.scan.ranges.size(), 0.5F);
    const auto movers = tracker.update(
        {0, each.scan, recording.laser, {T_map_laser, T_map_laser}, time, {}, 0.02, each.stamp, {}});
    const double dt = before.ns == 0 ? 0 : std::min((each.stamp - before).seconds(), 0.5);
    before = each.stamp;
    if (!each.labelled) {
      result.skip(dt);
      continue;
    }
    std::vector<people::Mover> inside;
    for (people::Mover mover : movers) {
      mover.position = each.T_map_laser.inverse() * mover.position;
      const double bearing = std::abs(std::atan2(mover.position.y(), mover.position.x()));
      if (bearing < recording.sector && mover.position.norm() < recording.reach) inside.push_back(mover);
    }
    result.add(inside, each.people, recording.complete, dt);
  }
  result.finish();
  return result;
}

}  // namespace parhelion::test
