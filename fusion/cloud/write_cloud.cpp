#include "fusion/cloud/write_cloud.hpp"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>

namespace parhelion::cloud {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the binary formats are written as memory has them");

/// Shortest text that is read back to the same bits.
std::string exact(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

Status check(const std::filesystem::path& path, const CloudColumns& cloud) {
  const auto fits = [&cloud](std::size_t size) { return size == 0 || size == cloud.points.size(); };
  if (!fits(cloud.normals.size()) || !fits(cloud.colours.size()) || !fits(cloud.labels.size()) ||
      !fits(cloud.scans.size())) {
    return Error{path.string() + ": not written: the cloud's columns have unequal lengths"};
  }
  const bool finite = std::all_of(cloud.points.begin(), cloud.points.end(),
                                  [](const Eigen::Vector3f& p) { return p.allFinite(); });
  return finite ? Status() : Error{path.string() + ": not written: the cloud has points that are not finite"};
}

/// Writes header and records to a temporary file, then renames it.
class File {
 public:
  explicit File(const std::filesystem::path& path) : path_(path), beside_(path.string() + ".part") {
    file_.reset(std::fopen(beside_.c_str(), "wb"));
    good_ = file_ != nullptr;
    buffer_.reserve(kCapacity);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() {
    if (!placed_ && file_ != nullptr) std::remove(beside_.c_str());
  }

  void put(const void* bytes, std::size_t size) {
    if (buffer_.size() + size > kCapacity) flush();
    buffer_.append(static_cast<const char*>(bytes), size);
  }
  void put(const std::string& text) { put(text.data(), text.size()); }

  Status place() {
    if (good_) flush();
    good_ = good_ && std::fflush(file_.get()) == 0;
    if (good_) placed_ = std::rename(beside_.c_str(), path_.c_str()) == 0;
    return placed_ ? Status() : Error{path_.string() + ": cannot be written: " + std::strerror(errno)};
  }

 private:
  static constexpr std::size_t kCapacity = std::size_t{1} << 20;
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  void flush() {
    good_ = good_ && std::fwrite(buffer_.data(), 1, buffer_.size(), file_.get()) == buffer_.size();
    buffer_.clear();
  }

  std::filesystem::path path_;
  std::string beside_, buffer_;
  std::unique_ptr<std::FILE, Close> file_;
  bool good_ = false, placed_ = false;
};

void put_records(const CloudColumns& cloud, bool packed_colour, File& file) {
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    file.put(cloud.points[i].data(), 12);
    if (!cloud.normals.empty()) file.put(cloud.normals[i].data(), 12);
    if (!cloud.colours.empty()) {
      const auto& [red, green, blue] = cloud.colours[i];
      const std::array<std::uint8_t, 4> packed{blue, green, red, 0};
      packed_colour ? file.put(packed.data(), 4) : file.put(cloud.colours[i].data(), 3);
    }
    if (!cloud.labels.empty()) file.put(&cloud.labels[i], 1);
    if (!cloud.scans.empty()) file.put(&cloud.scans[i], 2);
  }
}

}  // namespace

Status write_ply(const std::filesystem::path& path, const CloudColumns& cloud) {
  if (Status status = check(path, cloud); !status) return status;
  std::string header = "ply\nformat binary_little_endian 1.0\ncomment metres, x forward, y left, z up\n";
  for (std::size_t i = 0; i < cloud.viewpoints.size(); ++i) {
    const Eigen::Vector3d& p = cloud.viewpoints[i];
    header += "comment viewpoint " + std::to_string(i) + " " + exact(p.x()) + " " + exact(p.y()) + " " +
              exact(p.z()) + "\n";
  }
  header += "element vertex " + std::to_string(cloud.points.size()) +
            "\nproperty float x\nproperty float y\nproperty float z\n";
  if (!cloud.normals.empty()) header += "property float nx\nproperty float ny\nproperty float nz\n";
  if (!cloud.colours.empty()) header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  if (!cloud.labels.empty()) header += "property uchar label\n";
  if (!cloud.scans.empty()) header += "property ushort scan\n";
  File file(path);
  file.put(header + "end_header\n");
  put_records(cloud, false, file);
  return file.place();
}

Status write_pcd(const std::filesystem::path& path, const CloudColumns& cloud) {
  if (Status status = check(path, cloud); !status) return status;
  std::string fields = "x y z", sizes = "4 4 4", types = "F F F", counts = "1 1 1";
  const auto add = [&](const char* name, const char* size, const char* type) {
    fields.append(" ").append(name);
    sizes.append(" ").append(size);
    types.append(" ").append(type);
    counts.append(" 1");
  };
  if (!cloud.normals.empty()) {
    for (const char* name : {"normal_x", "normal_y", "normal_z"}) add(name, "4", "F");
  }
  if (!cloud.colours.empty()) add("rgb", "4", "U");
  if (!cloud.labels.empty()) add("label", "1", "U");
  if (!cloud.scans.empty()) add("scan", "2", "U");
  const Eigen::Vector3d p = cloud.viewpoints.size() == 1 ? cloud.viewpoints[0] : Eigen::Vector3d::Zero();
  const std::string count = std::to_string(cloud.points.size());
  File file(path);
  file.put("# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS " + fields + "\nSIZE " + sizes +
           "\nTYPE " + types + "\nCOUNT " + counts + "\nWIDTH " + count + "\nHEIGHT 1\nVIEWPOINT " +
           exact(p.x()) + " " + exact(p.y()) + " " + exact(p.z()) + " 1 0 0 0\nPOINTS " + count +
           "\nDATA binary\n");
  put_records(cloud, true, file);
  return file.place();
}

}  // namespace parhelion::cloud
