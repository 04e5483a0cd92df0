#include "tools/import/bag_source.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <utility>
#include <vector>

#include "protocols/yaml/document.hpp"
#include "tools/export/mcap_records.hpp"
#include "tools/import/bag_database.hpp"
#include "tools/import/mcap_reader.hpp"
#include "tools/import/rosbag_reader.hpp"
#include "tools/import/zstd_data.hpp"

namespace parhelion::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMetadata = "metadata.yaml";

enum class BagFormat { none, rosbag, database, mcap, zstd };

std::string head_of(const fs::path& path) {
  std::string head(32, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  return head;
}

BagFormat format_of(const fs::path& path) {
  const std::string head = head_of(path);
  if (head.starts_with("#ROSBAG V2.0")) return BagFormat::rosbag;
  if (head.starts_with("SQLite format 3")) return BagFormat::database;
  if (head.starts_with(mcap::kMagic)) return BagFormat::mcap;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(head.data());
  return is_zstd({bytes, head.size()}) ? BagFormat::zstd : BagFormat::none;
}

/// No folder, of which a recording could be a part of itself.
bool is_file(const fs::path& path) {
  std::error_code failed;
  return fs::is_regular_file(path, failed);
}

bool has_metadata(const fs::path& folder) {
  std::string first;
  std::ifstream metadata(folder / kMetadata);
  return std::getline(metadata, first) && first.starts_with("rosbag2_bagfile_information");
}

/// Shorter names first: _2 before _10.
std::vector<fs::path> recordings_in(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code failed;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    const fs::path& path = at->path();
    const std::string name = path.filename().string();
    const bool packed = name.ends_with(".db3.zstd") || name.ends_with(".mcap.zstd");
    if (!packed && !name.ends_with(".db3") && !name.ends_with(".mcap")) continue;
    // Not twice, where somebody inflated it.
    if (is_file(path) && !(packed && is_file(folder / path.stem()))) found.push_back(path);
  }
  std::sort(found.begin(), found.end(), [](const fs::path& a, const fs::path& b) {
    const std::string first = a.string(), second = b.string();
    return std::pair(first.size(), first) < std::pair(second.size(), second);
  });
  return found;
}

/// A folder of pictures, beside which somebody may have put a recording.
bool has_pictures(const fs::path& folder) {
  std::error_code failed;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    const std::string name = at->path().filename().string();
    if (name.ends_with(".png") || name.ends_with(".jpg") || name == "rgb" || name == "depth") return true;
  }
  return false;
}

/// The files that metadata.yaml lists, in its order.
Result<std::vector<fs::path>> listed_in(const fs::path& folder) {
  const fs::path metadata = folder / kMetadata;
  const auto text = yaml::read_text(metadata.string());
  if (!text) return text.error();
  const auto document = yaml::read_document(*text, metadata.string());
  if (!document) return document.error();
  const yaml::Node* bag = document->find("rosbag2_bagfile_information");
  const yaml::Node* files = bag == nullptr ? nullptr : bag->find("relative_file_paths");
  if (files == nullptr || files->kind != yaml::Node::Kind::list)
    return Error{metadata.string() +
                 ": without 'relative_file_paths'; expected the metadata of a ROS 2 recording"};
  std::vector<fs::path> listed;
  for (const yaml::Node& file : files->items) {
    // The first versions wrote the folder's name, too.
    fs::path path = folder / file.text;
    if (!is_file(path)) path = folder / fs::path(file.text).filename();
    if (!is_file(path))
      return Error{metadata.string() + ":" + std::to_string(file.line) + ": '" + file.text +
                   "' is missing; import the files that are there one by one"};
    listed.push_back(path);
  }
  return listed;
}

/// A folder that is removed with its files.
class Scratch {
 public:
  Scratch() {
    std::error_code failed;
    const fs::path temporary = fs::temp_directory_path(failed);
    std::string name = (temporary / "parhelion-import-XXXXXX").string();
    if (!failed && mkdtemp(name.data()) != nullptr) folder_ = name;
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch() {
    std::error_code ignored;
    if (!folder_.empty()) fs::remove_all(folder_, ignored);
  }
  /// Empty: it could not be made.
  const fs::path& folder() const { return folder_; }

 private:
  fs::path folder_;
};

/// A file that was inflated to be read.
class InflatedBag final : public BagSource {
 public:
  static Result<std::unique_ptr<BagSource>> open(const fs::path& path) {
    auto inflated = std::make_unique<InflatedBag>();
    inflated->path_ = path.string();
    if (inflated->scratch_.folder().empty())
      return Error{path.string() + ": no temporary folder in which it could be inflated: set TMPDIR"};
    const fs::path file = inflated->scratch_.folder() / path.stem();
    if (const Status done = inflate_zstd_file(path, file); !done) return done.error();
    auto inside =
        format_of(file) == BagFormat::zstd ? Error{path.string() + ": compressed twice"} : open_bag(file);
    if (!inside) return inflated->renamed(inside.error());
    inflated->inside_ = std::move(*inside);
    return std::unique_ptr<BagSource>(std::move(inflated));
  }
  Result<bool> next(BagMessage& message) override {
    auto more = inside_->next(message);
    if (!more) return renamed(more.error());
    return more;
  }
  std::uint64_t messages() const override { return inside_->messages(); }
  double done() const override { return inside_->done(); }
  double total() const override { return inside_->total(); }

 private:
  /// With the file that people know.
  Error renamed(Error error) const {
    const std::string scratch = (scratch_.folder() / fs::path(path_).stem()).string();
    if (const auto at = error.message.find(scratch); at != std::string::npos)
      error.message.replace(at, scratch.size(), path_);
    return error;
  }

  std::string path_;
  Scratch scratch_;
  std::unique_ptr<BagSource> inside_;
};

/// The files of one recording, one after the other.
class SplitBag final : public BagSource {
 public:
  explicit SplitBag(std::vector<fs::path> files) : files_(std::move(files)) {
    std::error_code ignored;
    for (const fs::path& file : files_) total_ += static_cast<double>(fs::file_size(file, ignored));
  }

  Result<bool> next(BagMessage& message) override {
    for (; index_ < files_.size(); finish()) {
      if (bag_ == nullptr) {
        auto opened = open_bag(files_[index_]);
        if (!opened) return finish(), opened.error();
        bag_ = std::move(*opened);
      }
      auto more = bag_->next(message);
      if (!more) return more;
      if (!*more) continue;
      message.number = ++messages_;
      return true;
    }
    return false;
  }
  std::uint64_t messages() const override { return messages_; }
  double done() const override {
    const double inside = bag_ == nullptr || bag_->total() <= 0 ? 0 : bag_->done() / bag_->total();
    return total_ * (static_cast<double>(index_) + inside) /
           static_cast<double>(std::max<std::size_t>(1, files_.size()));
  }
  double total() const override { return total_; }

 private:
  void finish() {
    bag_.reset();
    ++index_;
  }

  std::vector<fs::path> files_;
  double total_ = 0;  ///< bytes
  std::size_t index_ = 0;
  std::unique_ptr<BagSource> bag_;
  std::uint64_t messages_ = 0;
};

}  // namespace

bool is_bag(const std::filesystem::path& path) {
  std::error_code failed;
  if (fs::is_directory(path, failed))
    return has_metadata(path) || (!recordings_in(path).empty() && !has_pictures(path));
  return format_of(path) != BagFormat::none;
}

Result<std::unique_ptr<BagSource>> open_bag(const std::filesystem::path& path) {
  std::error_code failed;
  if (fs::is_directory(path, failed)) {
    auto files = has_metadata(path) ? listed_in(path) : Result(recordings_in(path));
    if (!files) return files.error();
    return std::unique_ptr<BagSource>(std::make_unique<SplitBag>(std::move(*files)));
  }
  switch (format_of(path)) {
    case BagFormat::rosbag: {
      auto bag = BagReader::open(path);
      if (!bag) return bag.error();
      return std::unique_ptr<BagSource>(std::make_unique<BagReader>(std::move(*bag)));
    }
    case BagFormat::database:
      return open_bag_database(path);
    case BagFormat::mcap:
      return open_mcap(path);
    case BagFormat::zstd:
      return InflatedBag::open(path);
    case BagFormat::none:
      break;
  }
  return Error{path.string() + ": not a ROS recording: a .bag, .db3 or .mcap file is expected"};
}

}  // namespace parhelion::tools
