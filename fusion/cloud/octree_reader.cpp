// OctoMap's binary octrees (.bt): the centres of the occupied cubes (Hornung et al. 2013; two bits a child).
#include <cmath>

#include "fusion/cloud/cloud_builder.hpp"
#include "fusion/cloud/cloud_text.hpp"

namespace parhelion::cloud {
namespace {

constexpr int kDepth = 16;  ///< of the tree
constexpr int kWidest = 4;  ///< cubes along the side of a pruned leaf whose shell becomes points
constexpr std::string_view kMagic = "# Octomap OcTree binary file";

/// Of a child's two bits, the first as 1, the second as 2; 0: unknown, 1: free.
constexpr unsigned kOccupied = 2, kInner = 3;

class Octree {
 public:
  Octree(std::string_view bytes, CloudBuilder builder) : bytes_(bytes), builder_(std::move(builder)) {}

  Result<ScanFile> read() {
    if (Status status = read_header(); !status) return status.error();
    // Each node has two bytes; a pruned leaf of four cubes a side is a shell of 56 points.
    for (const Column column : {Column::x, Column::y, Column::z}) builder_.declare(column);
    const std::size_t body = at_;
    std::uint64_t points = 0;
    if (Status status = walk([&](const Eigen::Vector3d&) { ++points; }); !status) return status.error();
    if (Status status = builder_.reserve(points); !status) return status.error();
    at_ = body;
    Record record{};
    const Status status = walk([&](const Eigen::Vector3d& p) {
      for (int axis = 0; axis < 3; ++axis) record[static_cast<std::size_t>(axis)] = p[axis];
      builder_.add(record);
    });
    if (!status) return status.error();
    auto scan = builder_.finish();
    if (scan) scan->spacing = resolution_;
    return scan;
  }

 private:
  Error wrong(const std::string& what) const { return error_at_byte(builder_.name(), at_, what); }

  Status read_header() {
    LineCursor lines(bytes_);
    const auto magic = lines.next();
    if (!magic || !magic->starts_with(kMagic)) return wrong("expected \"" + std::string(kMagic) + "\"");
    while (const auto line = lines.next()) {
      std::string_view rest = *line;
      const std::string_view key = next_token(rest);
      if (key == "data") {
        at_ = lines.offset();
        if (resolution_ > 0) return {};
        break;
      }
      const std::string_view value = next_token(rest);
      if (key == "id" && value != "OcTree")
        return error_at_line(builder_.name(), lines.number(), "expected an OcTree, not " + in_quotes(value));
      if (key != "res") continue;
      const auto number = parse_number<double>(value);
      if (!number || !(*number > 1e-4) || !(*number < 100))
        return error_at_line(builder_.name(), lines.number(),
                             "expected a resolution in m, not " + in_quotes(value));
      resolution_ = *number;
    }
    return error_at_line(builder_.name(), lines.number(), "expected \"res\" and \"data\" before the tree");
  }

  template <class Visit>
  Status walk(Visit&& visit) {
    if (at_ >= bytes_.size()) return {};  // an empty tree
    return node(Eigen::Vector3d::Zero(), 0, visit);
  }

  /// `centre`: m; the children of a node are four times two bits in each of its bytes.
  template <class Visit>
  Status node(const Eigen::Vector3d& centre, int depth, Visit& visit) {
    if (bytes_.size() - at_ < 2) return wrong("the file ends within the tree");
    if (depth >= kDepth) return wrong("the tree is deeper than 16 levels");
    const unsigned low = static_cast<unsigned char>(bytes_[at_]),
                   high = static_cast<unsigned char>(bytes_[at_ + 1]), bits = low | high << 8;
    at_ += 2;
    const double quarter = resolution_ * std::ldexp(1.0, kDepth - depth - 2);
    for (unsigned c = 0; c < 8; ++c) {
      const Eigen::Vector3d middle =
          centre +
          quarter * Eigen::Vector3d((c & 1) != 0 ? 1 : -1, (c & 2) != 0 ? 1 : -1, (c & 4) != 0 ? 1 : -1);
      if ((bits >> (2 * c) & 3) == kOccupied) leaf(middle, depth + 1, visit);
    }
    for (unsigned c = 0; c < 8; ++c) {
      if ((bits >> (2 * c) & 3) != kInner) continue;
      const Eigen::Vector3d middle =
          centre +
          quarter * Eigen::Vector3d((c & 1) != 0 ? 1 : -1, (c & 2) != 0 ? 1 : -1, (c & 4) != 0 ? 1 : -1);
      if (Status status = node(middle, depth + 1, visit); !status) return status;
    }
    return {};
  }

  /// The shell of an occupied leaf, in cubes of the resolution; of a larger one in four a side.
  template <class Visit>
  void leaf(const Eigen::Vector3d& middle, int depth, Visit& visit) const {
    const double side = resolution_ * std::ldexp(1.0, kDepth - depth);
    const int n = std::min(kWidest, 1 << (kDepth - depth));
    const auto at = [&](int k) { return side * ((k + 0.5) / n - 0.5); };
    for (int z = 0; z < n; ++z) {
      for (int y = 0; y < n; ++y) {
        for (int x = 0; x < n; ++x) {
          const auto edge = [&](int k) { return k == 0 || k == n - 1; };
          if (edge(x) || edge(y) || edge(z))
            visit(Eigen::Vector3d(middle + Eigen::Vector3d(at(x), at(y), at(z))));
        }
      }
    }
  }

  std::string_view bytes_;
  CloudBuilder builder_;
  std::size_t at_ = 0;
  double resolution_ = 0;
};

}  // namespace

Result<ScanFile> parse_octree(std::string_view bytes, CloudBuilder builder) {
  return Octree(bytes, std::move(builder)).read();
}

}  // namespace parhelion::cloud
