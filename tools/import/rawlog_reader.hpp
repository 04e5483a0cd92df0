// Reads the objects of an MRPT rawlog, whole or damaged, without ever going down with MRPT.
#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <string>

#include "protocols/status.hpp"
#include "tools/import/recording_writer.hpp"

namespace mrpt::obs {
class CActionCollection;
class CObservation;
}  // namespace mrpt::obs

namespace parhelion::tools {

/// Gets each object of a rawlog, in the file's order; an error ends the reading.
struct RawlogVisitor {
  virtual ~RawlogVisitor() = default;
  virtual Status action(const mrpt::obs::CActionCollection& actions, Place place) = 0;
  virtual Status observation(const mrpt::obs::CObservation& observation, Place place) = 0;
  virtual void other(const std::string& class_name) = 0;
  virtual void damage(Place place, const std::string& what) = 0;
  virtual void read_one() {}
};

/// How much of the file can be believed.
struct Trust {
  bool intact = false;               ///< its checksum is right: MRPT wrote all of it
  std::set<std::uint64_t> crashing;  ///< bytes at which objects start that MRPT can't survive
};

struct RawlogReading {
  std::string path;
  const Trust& trust;
  std::function<void(std::uint64_t)> before_object;  ///< told where each object starts
  std::function<void(double)> progress;              ///< told bytes done, of the file as it lies on disk
};

/// Every object of the file, in its order. After a damaged one reading goes on at the next that can be
/// recognised.
Status read_rawlog(const RawlogReading& reading, RawlogVisitor& visitor);

/// MRPT crashes on some damage. A file without a right checksum is read in child processes, by `try_out`,
/// until none crashes; where one did, the object is left alone.
Result<Trust> judge_rawlog(const std::string& path,
                           const std::function<void(const RawlogReading& reading)>& try_out);

}  // namespace parhelion::tools
