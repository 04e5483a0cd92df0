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

/// Result of checking a file.
struct Trust {
  std::set<std::uint64_t> crashing;  ///< byte offsets of objects that crash MRPT
};

struct RawlogReading {
  std::string path;
  const Trust& trust;
  std::function<void(std::uint64_t)> before_object;  ///< called with the offset of each object
  std::function<void(double)> progress;              ///< called with the bytes done, of the file on disk
};

/// Reads all objects in file order. After a damaged object, reading resumes at the next recognizable one.
Status read_rawlog(const RawlogReading& reading, RawlogVisitor& visitor);

/// MRPT crashes on some damage. The file is read in child processes, by `try_out`, until none crashes;
/// objects that cause a crash are skipped. Error: a child used too much processor time.
Result<Trust> judge_rawlog(const std::string& path,
                           const std::function<void(const RawlogReading& reading)>& try_out);

}  // namespace parhelion::tools
