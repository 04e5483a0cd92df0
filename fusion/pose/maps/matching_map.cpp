#include "fusion/pose/maps/matching_map.hpp"

#include <bit>
#include <cmath>
#include <cstddef>
#include <optional>

#include "fusion/pose/maps/frozen_map.hpp"

namespace parhelion::pose {
namespace {

// Little-endian: "PHM1", id (length, bytes), sigma, side of a cell (64 bits), number of cells; of each cell
// its column and row, number of points, and moments. The other numbers have 32 bits.
constexpr std::uint32_t kMark = 0x314D4850;
constexpr std::size_t kCellSize = std::size_t{8} * 4;
constexpr std::size_t kMaxCells = 2'000'000;  ///< 20,000 m^2 of surfaces at 0.1 m
constexpr std::size_t kMaxId = 256;
constexpr double kMinCell = 0.01, kMaxCell = 2;  ///< m
constexpr std::int32_t kFarthest = 16'000;  ///< cells from the origin: bounds the memory of a damaged map
constexpr int kCoarse = 4;                  ///< cells of the fine map along a side of a coarse one

class Packer {
 public:
  void number(std::uint32_t value) {
    for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::uint8_t>(value >> shift));
  }
  void number(std::int32_t value) { number(static_cast<std::uint32_t>(value)); }
  void number(double value) { number(std::bit_cast<std::uint32_t>(static_cast<float>(value))); }
  void exact(double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    number(static_cast<std::uint32_t>(bits));
    number(static_cast<std::uint32_t>(bits >> 32U));
  }

  std::vector<std::uint8_t> bytes;
};

class Unpacker {
 public:
  explicit Unpacker(std::span<const std::uint8_t> bytes) : left_(bytes) {}

  std::size_t left() const { return left_.size(); }
  /// 0 beyond the end.
  std::uint32_t number() {
    if (left_.size() < 4) return 0;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value |= std::uint32_t{left_[i]} << (8 * i);
    left_ = left_.subspan(4);
    return value;
  }
  std::int32_t integer() { return static_cast<std::int32_t>(number()); }
  double real() { return static_cast<double>(std::bit_cast<float>(number())); }
  double exact() {
    const std::uint64_t low = number();
    return std::bit_cast<double>(low | std::uint64_t{number()} << 32U);
  }
  std::string text(std::size_t size) {
    const auto part = left_.first(std::min(size, left_.size()));
    left_ = left_.subspan(part.size());
    return {part.begin(), part.end()};
  }

 private:
  std::span<const std::uint8_t> left_;
};

/// nullopt: the moments are not those of points in the cell.
std::optional<SurfelMap::Moments> read_cell(Unpacker& from, double cell) {
  SurfelMap::Moments m;
  m.column = from.integer();
  m.row = from.integer();
  for (double* value : {&m.n, &m.x, &m.y, &m.xx, &m.xy, &m.yy}) *value = from.real();
  const double first = m.n * cell, second = first * cell;
  const bool possible = std::abs(m.column) < kFarthest && std::abs(m.row) < kFarthest && m.n > 0 &&
                        m.n < 1e9 && std::abs(m.x) <= first && std::abs(m.y) <= first && m.xx >= 0 &&
                        m.xx <= second && std::abs(m.xy) <= second && m.yy >= 0 && m.yy <= second;
  return possible ? std::optional(m) : std::nullopt;
}

int floor_divide(int a, int b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

/// The same points as moments of a cell `kCoarse` times as large.
SurfelMap::Moments coarser(const SurfelMap::Moments& fine, double cell) {
  SurfelMap::Moments m = fine;
  m.column = floor_divide(fine.column, kCoarse);
  m.row = floor_divide(fine.row, kCoarse);
  const double dx = (fine.column - kCoarse * m.column - (kCoarse - 1) / 2.0) * cell;
  const double dy = (fine.row - kCoarse * m.row - (kCoarse - 1) / 2.0) * cell;
  m.x += m.n * dx;
  m.y += m.n * dy;
  m.xx += 2 * dx * fine.x + m.n * dx * dx;
  m.yy += 2 * dy * fine.y + m.n * dy * dy;
  m.xy += dx * fine.y + dy * fine.x + m.n * dx * dy;
  return m;
}

}  // namespace

Result<std::vector<std::uint8_t>> pack_matching_map(const std::string& path) {
  constexpr double resolution = 0.05;  // m, of the grid that gives a .simplemap its id
  auto map = load_frozen_map(path, resolution);
  if (!map) return map.error();
  const std::vector<SurfelMap::Moments> cells = map->fine.moments();
  if (cells.size() > kMaxCells)
    return Error{path + ": has surfaces in " + std::to_string(cells.size()) + " cells of " +
                 std::to_string(map->fine.cell()) + " m; at most " + std::to_string(kMaxCells) +
                 " can be matched: use a map of this site alone"};
  Packer packer;
  packer.number(kMark);
  packer.number(static_cast<std::uint32_t>(map->grid.id.size()));
  packer.bytes.insert(packer.bytes.end(), map->grid.id.begin(), map->grid.id.end());
  packer.number(map->sigma);
  packer.exact(map->fine.cell());
  packer.number(static_cast<std::uint32_t>(cells.size()));
  for (const SurfelMap::Moments& cell : cells) {
    packer.number(cell.column);
    packer.number(cell.row);
    for (const double value : {cell.n, cell.x, cell.y, cell.xx, cell.xy, cell.yy}) packer.number(value);
  }
  return packer.bytes;
}

Result<MatchingMap> unpack_matching_map(std::span<const std::uint8_t> bytes, const std::string& origin) {
  const Error damaged{origin + ": the map is damaged"};
  Unpacker from(bytes);
  if (from.number() != kMark) return damaged;
  const std::uint32_t id_size = from.number();
  if (id_size > kMaxId) return damaged;
  MatchingMap map;
  map.id = from.text(id_size);
  map.sigma = from.real();
  const double cell = from.exact();
  const std::size_t count = from.number();
  if (!(map.sigma > 0 && map.sigma < 1) || !(cell >= kMinCell && cell <= kMaxCell) || count > kMaxCells ||
      from.left() != count * kCellSize)
    return damaged;
  map.fine = SurfelMap(cell);
  map.coarse = SurfelMap(kCoarse * cell);
  for (std::size_t i = 0; i < count; ++i) {
    const auto moments = read_cell(from, cell);
    if (!moments) return damaged;
    map.fine.add(*moments);
    map.coarse.add(coarser(*moments, cell));
  }
  map.fine.finish();
  map.coarse.finish();
  map.packed.assign(bytes.begin(), bytes.end());
  return map;
}

}  // namespace parhelion::pose
