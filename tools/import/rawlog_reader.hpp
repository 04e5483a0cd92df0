// Reads the objects of an MRPT rawlog, intact or damaged, and survives crashes of MRPT.
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

/// Receives each object of a rawlog in file order; an error stops the reading.
struct RawlogVisitor {
  virtual ~RawlogVisitor() = default;
  virtual Status action(const mrpt::obs::CActionCollection& actions, Place place) = 0;
  virtual Status observation(const mrpt::obs::CObservation& observation, Place place) = 0;
  virtual void other(const std::string& class_name) = 0;
  virtual void damage(Place place, const std::string& what) = 0;
  virtual void read_one() {}
};

struct RawlogReading {
  std::string path;
  const std::set<std::uint64_t>& crashing;           ///< byte offsets of objects that crash MRPT: skipped
  std::function<void(std::uint64_t)> before_object;  ///< called with the offset of each object
  std::function<void(double)> progress;              ///< called with the bytes done, of the file on disk
};

/// Reads all objects in file order. After a damaged object, reading resumes at the next recognizable one.
Status read_rawlog(const RawlogReading& reading, RawlogVisitor& visitor);

/// MRPT crashes on some damage, so `work` reads in a child process and returns bytes. Where it crashes it is
/// started again, and the object that caused it is skipped. `progress` may be empty. Error: `work` needs too
/// much processor time, or crashes too often.
Result<std::string> work_on_rawlog(const std::string& path,
                                   const std::function<std::string(const RawlogReading&)>& work,
                                   const std::function<void(double)>& progress);

}  // namespace parhelion::tools
