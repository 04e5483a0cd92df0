// Global nearest neighbour: the assignment of rows to columns with the least total cost.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace parhelion::people {

/// A possible pair; pairs that are not listed are impossible.
struct Candidate {
  std::uint32_t row = 0, column = 0;
  double cost = 0;
};

/// Memory is reused from call to call. Rows that share no column, even indirectly, are solved apart from each
/// other: exactly (Hungarian method) up to kExact rows and columns, beyond that greedily by cost, so that the
/// time is bounded.
class Assignment {
 public:
  static constexpr std::size_t kExact = 16;
  static constexpr std::int32_t kNone = -1;

  void reserve(std::size_t rows, std::size_t columns, std::size_t candidates);

  /// The column of each row, or kNone; a row without a column costs `unassigned`. Valid until the next call.
  std::span<const std::int32_t> solve(std::size_t rows, std::size_t columns,
                                      std::span<const Candidate> candidates, double unassigned);

 private:
  std::uint32_t root(std::uint32_t node);
  void group(std::size_t rows, std::size_t columns);
  void solve_group(std::size_t first, std::size_t last, double unassigned);
  void solve_exactly(std::size_t first, std::size_t last, double unassigned);
  void solve_greedily(std::size_t first, std::size_t last, double unassigned);

  std::vector<Candidate> candidates_;  // by group
  std::vector<std::uint32_t> parent_;  // rows, then columns
  std::vector<std::uint32_t> group_rows_, group_columns_;
  std::vector<std::int32_t> column_of_row_;
  std::vector<char> column_taken_;
};

}  // namespace parhelion::people
