#include "fusion/cloud/read_cloud.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <numbers>

#include "fusion/cloud/cloud_builder.hpp"
#include "fusion/cloud/cloud_text.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion::cloud {
namespace {

/// A file's content, mapped into memory that the kernel can reclaim.
class MappedFile {
 public:
  static Result<MappedFile> open(const std::filesystem::path& path) {
    const auto failed = [&path](const char* what) {
      return Error{path.string() + ": cannot be " + what + ": " + std::strerror(errno)};
    };
    MappedFile file;
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) return failed("opened");
    struct stat status {};
    if (::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode)) {
      file.size_ = static_cast<std::size_t>(status.st_size);
      if (file.size_ > 0) file.start_ = ::mmap(nullptr, file.size_, PROT_READ, MAP_PRIVATE, descriptor, 0);
    } else {
      errno = S_ISDIR(status.st_mode) ? EISDIR : EINVAL;
      file.start_ = MAP_FAILED;
    }
    const bool mapped = file.start_ != MAP_FAILED;
    const int error = errno;
    ::close(descriptor);
    errno = error;
    if (mapped) return file;
    file.start_ = nullptr;
    return failed("read");
  }
  MappedFile(MappedFile&& other) noexcept
      : start_(std::exchange(other.start_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  MappedFile& operator=(MappedFile&&) = delete;
  ~MappedFile() {
    if (start_ != nullptr) ::munmap(start_, size_);
  }

  std::string_view content() const { return {static_cast<const char*>(start_), size_}; }

 private:
  MappedFile() = default;
  void* start_ = nullptr;
  std::size_t size_ = 0;
};

std::optional<ScanFormat> format_of(std::string_view bytes, const std::filesystem::path& path) {
  if (bytes.starts_with("ply\n") || bytes.starts_with("ply\r")) return ScanFormat::ply;
  if (bytes.starts_with("# .PCD")) return ScanFormat::pcd;
  if (bytes.starts_with("# Octomap OcTree binary")) return ScanFormat::octree;
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".laz") return std::nullopt;
  if (bytes.starts_with("LASF")) return ScanFormat::las;
  if (extension == ".ply") return ScanFormat::ply;
  if (extension == ".pcd") return ScanFormat::pcd;
  if (extension == ".las") return ScanFormat::las;
  if (extension == ".bt") return ScanFormat::octree;
  if (extension == ".3d") return ScanFormat::uos_3d;
  for (const char* text : {".xyz", ".txt", ".asc", ".pts", ".csv"}) {
    if (extension == text) return ScanFormat::xyz;
  }
  return std::nullopt;
}

/// For formats that no library of Debian reads: the command that makes a .ply of the file; else nothing.
std::string how_to_convert(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  std::filesystem::path ply = path;
  ply.replace_extension(".ply");
  if (extension == ".laz") return "\nConvert it: pdal translate " + path.string() + " " + ply.string();
  if (extension == ".e57")
    return "\nConvert it: CloudCompare -SILENT -O " + path.string() + " -C_EXPORT_FMT PLY -SAVE_CLOUDS";
  return "";
}

}  // namespace

Error error_at_line(const std::string& name, std::uint64_t line, const std::string& what) {
  return Error{name + ":" + std::to_string(line) + ": " + what};
}

Error error_at_byte(const std::string& name, std::uint64_t offset, const std::string& what) {
  return Error{name + ": byte " + std::to_string(offset) + ": " + what};
}

std::string in_quotes(std::string_view word) {
  return word.empty() ? "the end of the line" : "\"" + yaml::printable(word) + "\"";
}

Result<ScanFile> parse_scan(std::string_view bytes, const std::string& name, ScanFormat format,
                            const ReadOptions& options) {
  CloudBuilder builder(name, format, options);
  switch (format) {
    case ScanFormat::ply:
      return parse_ply(bytes, std::move(builder));
    case ScanFormat::pcd:
      return parse_pcd(bytes, std::move(builder));
    case ScanFormat::xyz:
      return parse_xyz(bytes, std::move(builder), false);
    case ScanFormat::las:
      return parse_las(bytes, std::move(builder));
    case ScanFormat::octree:
      return parse_octree(bytes, std::move(builder));
    case ScanFormat::uos_3d:
      break;
  }
  return parse_xyz(bytes, std::move(builder), true);
}

Result<Transform<Cloud, Scanner>> parse_uos_pose(std::string_view bytes, const std::string& name,
                                                 const ReadOptions& options) {
  std::array<double, 6> numbers{};
  LineCursor lines(bytes);
  std::size_t count = 0;
  while (const auto line = lines.next()) {
    std::string_view rest = *line;
    for (std::string_view word = next_token(rest); !word.empty() && count < 6; word = next_token(rest)) {
      const auto number = parse_number<double>(word);
      if (!number || !std::isfinite(*number)) {
        return error_at_line(name, lines.number(), "expected a number, not " + in_quotes(word));
      }
      numbers[count++] = *number;
    }
  }
  if (count < 6) {
    return error_at_line(
        name, lines.number(),
        "expected x y z and three angles in degrees, the file has " + std::to_string(count) + " numbers");
  }
  const auto turn = [&numbers](int axis) {
    const double radians = numbers[static_cast<std::size_t>(axis) + 3] * std::numbers::pi / 180;
    return Eigen::AngleAxisd(radians, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
  };
  // M R M^-1: the scale cancels, and so does a mirroring.
  const Eigen::Matrix3d M = file_to_scanner(ScanFormat::uos_3d, options);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = M * (turn(0) * turn(1) * turn(2)) * M.inverse();
  pose.translation() = M * Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
  return Transform<Cloud, Scanner>(pose);
}

Result<ScanFile> read_scan(const std::filesystem::path& path, const ReadOptions& options) {
  const auto file = MappedFile::open(path);
  if (!file) return file.error();
  const auto format = format_of(file->content(), path);
  if (!format) {
    return Error{
        path.string() +
        ": unknown 3D scan format: expected .ply, .pcd, .las, .bt, .3d, or text as .xyz .txt .asc .pts .csv" +
        how_to_convert(path)};
  }
  auto scan = parse_scan(file->content(), path.string(), *format, options);
  std::filesystem::path pose_path = path;
  pose_path.replace_extension(".pose");
  std::error_code ignored;
  if (!scan || *format != ScanFormat::uos_3d || !std::filesystem::exists(pose_path, ignored)) return scan;
  const auto pose_file = MappedFile::open(pose_path);
  if (!pose_file) return pose_file.error();
  const auto pose = parse_uos_pose(pose_file->content(), pose_path.string(), options);
  if (!pose) return pose.error();
  scan->guess = *pose;
  return scan;
}

}  // namespace parhelion::cloud
