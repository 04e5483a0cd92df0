#include "tools/import/rawlog_reader.hpp"

#include <mrpt/io/CStream.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <limits>
#include <new>
#include <optional>
#include <utility>

#include "protocols/isolation.hpp"
#include "tools/import/gzip_file.hpp"

namespace parhelion::tools {
namespace {

namespace obs = mrpt::obs;

constexpr std::uint64_t kMaxBytes = 1ULL << 29;  // of memory that a reader may need besides what it has
constexpr std::uint64_t kMinSeconds = 1, kBytesPerSecond = 500'000;  // of processor time, in all
constexpr std::uint64_t kProgress = std::uint64_t{1} << 63U;  // marks reports that are no object's offset
constexpr int kMaxCrashes = 200;

/// MRPT's own gzip stream cannot seek back to the start of a damaged object.
class Stream final : public mrpt::io::CStream {
 public:
  explicit Stream(GzipFile& file) : file_(file) {}
  std::size_t Read(void* buffer, std::size_t count) override { return file_.read(buffer, count); }
  std::size_t Write(const void*, std::size_t) override { return 0; }
  std::uint64_t Seek(std::int64_t offset, TSeekOrigin origin) override {
    const auto from = origin == sFromCurrent ? static_cast<std::int64_t>(file_.position()) : 0;
    file_.seek(static_cast<std::uint64_t>(std::max<std::int64_t>(0, from + offset)));
    return file_.position();
  }
  std::uint64_t getTotalBytesCount() const override { return std::numeric_limits<std::uint64_t>::max(); }
  std::uint64_t getPosition() const override { return file_.position(); }

 private:
  GzipFile& file_;
};

/// A top-level object starts with 0x80 | length of its class name.
bool is_top_level_class(std::string name) {
  if (name.starts_with("mrpt::obs::")) name = name.substr(11);
  return name == "CSensoryFrame" || name == "CActionCollection" || name.starts_with("CObservation");
}

/// Seeks to the next possible start of a top-level object.
bool resynchronize(GzipFile& file) {
  for (int byte = file.next_byte(); byte >= 0; byte = file.next_byte()) {
    const int length = byte & 0x7F;
    if ((byte & 0x80) == 0 || length < 12 || length > 60) continue;
    const std::uint64_t start = file.position();
    std::string name(static_cast<std::size_t>(length), '\0');
    const bool found = file.read(name.data(), name.size()) == name.size() && is_top_level_class(name);
    file.seek(found ? start - 1 : start);
    if (found) return true;
  }
  return false;
}

Status visit(const mrpt::serialization::CSerializable& object, RawlogVisitor& visitor, Place place) {
  if (const auto* actions = dynamic_cast<const obs::CActionCollection*>(&object)) {
    return visitor.action(*actions, place);
  }
  if (const auto* frame = dynamic_cast<const obs::CSensoryFrame*>(&object)) {
    for (const auto& part : *frame) {
      if (Status done = visitor.observation(*part, place); !done) return done;
    }
    return {};
  }
  if (const auto* one = dynamic_cast<const obs::CObservation*>(&object))
    return visitor.observation(*one, place);
  visitor.other(object.GetRuntimeClass()->className);
  return {};
}

std::string first_line_of(const std::exception& error) {
  // MRPT's messages have several lines, "Message:" first.
  std::string text = error.what();
  if (const auto at = text.find("Message:"); at != std::string::npos) text = text.substr(at + 8);
  text = text.substr(0, text.find('\n'));
  text.erase(0, text.find_first_not_of(' '));
  return text.substr(0, 160);
}

/// Reads one object; returns its error, or empty.
Result<std::string> read_object(mrpt::serialization::CArchive& archive, RawlogVisitor& visitor, Place place) {
  try {
    const auto object = archive.ReadObject();
    if (!object) return std::string("no object here");
    visitor.read_one();
    if (const Status done = visit(*object, visitor, place); !done) return done.error();
    return std::string();
  } catch (const std::bad_alloc&) {
    return std::string("a count that cannot be");
  } catch (const std::exception& error) {
    return first_line_of(error);
  }
}

}  // namespace

Status read_rawlog(const RawlogReading& reading, RawlogVisitor& visitor) {
  GzipFile file(reading.path);
  if (!file.is_open()) return Error{reading.path + ": cannot be opened: " + std::strerror(errno)};
  Stream stream(file);
  auto archive = mrpt::serialization::archiveFrom(stream);
  bool damaged = false;
  for (Place place = 1;; ++place) {
    const std::uint64_t start = file.position();
    if (file.next_byte() < 0) {
      if (file.damaged() && !damaged) {
        visitor.damage(place, "the compressed data ends or is damaged at byte " + std::to_string(start) +
                                  " of the inflated file; what follows cannot be read");
      }
      return {};
    }
    file.seek(start);
    if (reading.before_object) reading.before_object(start);
    const auto what = reading.crashing.count(start) > 0
                          ? Result<std::string>(std::string("MRPT cannot read it"))
                          : read_object(archive, visitor, place);
    if (!what) return what.error();
    // Parts of a damaged object look like objects too: one refusal for a whole unreadable section.
    const bool was_damaged = std::exchange(damaged, !what->empty());
    if (damaged) {
      if (!was_damaged) {
        visitor.damage(place, "object at byte " + std::to_string(start) +
                                  " of the inflated file cannot be read: " + *what);
      }
      file.seek(start + 1);
      if (!resynchronize(file)) return {};
    }
    if (reading.progress && place % 64 == 0)
      reading.progress(static_cast<double>(file.compressed_position()));
  }
}

Result<std::string> work_on_rawlog(const std::string& path,
                                   const std::function<std::string(const RawlogReading&)>& work,
                                   const std::function<void(double)>& progress) {
  std::error_code no_file;
  const std::uint64_t size = std::filesystem::file_size(path, no_file);
  if (no_file) return Error{path + ": cannot be read: " + no_file.message()};
  const ChildLimits limits{kMaxBytes, kMinSeconds + size / kBytesPerSecond};
  std::set<std::uint64_t> crashing;
  double used = 0;
  for (int crashes = 0; crashes < kMaxCrashes; ++crashes) {
    std::optional<std::uint64_t> object;
    auto child = result_of_child(
        limits,
        [&](const std::function<void(std::uint64_t)>& report) {
          return work({path, crashing, report,
                       [&report](double done) { report(kProgress | static_cast<std::uint64_t>(done)); }});
        },
        [&](std::uint64_t report) {
          if ((report & kProgress) == 0)
            object = report;
          else if (progress)
            progress(static_cast<double>(report & ~kProgress));
        });
    if (!child) return child.error();
    if (child->end.completed) return std::move(child->bytes);
    used += child->end.seconds;
    if (child->end.out_of_time || used > static_cast<double>(limits.seconds)) {
      return Error{path + ": MRPT needed more than " + std::to_string(limits.seconds) +
                   " s of processor time for it: too damaged to be read"};
    }
    if (!object || !crashing.insert(*object).second) break;
  }
  return Error{path + ": too damaged to be read"};
}

}  // namespace parhelion::tools
