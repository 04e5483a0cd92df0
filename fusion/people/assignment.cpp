#include "fusion/people/assignment.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <tuple>

namespace parhelion::people {
namespace {

constexpr std::size_t kExact = Assignment::kExact;
constexpr double kImpossible = 1e9;

/// Costs of a group: its columns, then for each row a column of its own that stands for "none".
struct Costs {
  std::size_t rows = 0, columns = 0;
  std::array<double, kExact * 2 * kExact> cost;
  double& at(std::size_t row, std::size_t column) { return cost[row * 2 * kExact + column]; }
};

/// The Hungarian method by shortest augmenting paths (Jonker, Volgenant 1987); rows <= columns.
class Hungarian {
 public:
  explicit Hungarian(Costs& costs) : costs_(costs) {}

  /// The row of each column, plus one; 0: none.
  const std::array<std::size_t, 2 * kExact + 1>& solve() {
    for (std::size_t row = 1; row <= costs_.rows; ++row) augment(row);
    return row_of_;
  }

 private:
  void augment(std::size_t row) {
    row_of_[0] = row;
    min_cost_.fill(std::numeric_limits<double>::infinity());
    used_.fill(false);
    std::size_t column = 0;
    do column = extend(column);
    while (row_of_[column] != 0);
    while (column != 0) {
      row_of_[column] = row_of_[previous_[column]];
      column = previous_[column];
    }
  }

  /// Adds `column` to the tree of alternating paths and returns the next one.
  std::size_t extend(std::size_t column) {
    used_[column] = true;
    const std::size_t row = row_of_[column];
    double delta = std::numeric_limits<double>::infinity();
    std::size_t next = 0;
    for (std::size_t j = 1; j <= costs_.columns; ++j) {
      if (used_[j]) continue;
      const double reduced = costs_.at(row - 1, j - 1) - row_price_[row] - column_price_[j];
      if (reduced < min_cost_[j]) {
        min_cost_[j] = reduced;
        previous_[j] = column;
      }
      if (min_cost_[j] < delta) {
        delta = min_cost_[j];
        next = j;
      }
    }
    for (std::size_t j = 0; j <= costs_.columns; ++j) {
      if (used_[j]) {
        row_price_[row_of_[j]] += delta;
        column_price_[j] -= delta;
      } else {
        min_cost_[j] -= delta;
      }
    }
    return next;
  }

  Costs& costs_;
  std::array<std::size_t, 2 * kExact + 1> row_of_{}, previous_{};
  std::array<double, 2 * kExact + 1> column_price_{}, min_cost_{};
  std::array<double, kExact + 1> row_price_{};
  std::array<bool, 2 * kExact + 1> used_{};
};

std::size_t index_in(std::span<const std::uint32_t> sorted, std::uint32_t value) {
  return static_cast<std::size_t>(std::lower_bound(sorted.begin(), sorted.end(), value) - sorted.begin());
}

void sort_unique(std::vector<std::uint32_t>& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

}  // namespace

void Assignment::reserve(std::size_t rows, std::size_t columns, std::size_t candidates) {
  candidates_.reserve(candidates);
  group_rows_.reserve(candidates);
  group_columns_.reserve(candidates);
  parent_.reserve(rows + columns);
  column_of_row_.reserve(rows);
  column_taken_.reserve(columns);
}

std::span<const std::int32_t> Assignment::solve(std::size_t rows, std::size_t columns,
                                                std::span<const Candidate> candidates, double unassigned) {
  candidates_.assign(candidates.begin(), candidates.end());
  column_of_row_.assign(rows, kNone);
  column_taken_.assign(columns, 0);
  group(rows, columns);
  for (std::size_t first = 0; first < candidates_.size();) {
    const std::uint32_t here = root(candidates_[first].row);
    std::size_t last = first;
    while (last < candidates_.size() && root(candidates_[last].row) == here) ++last;
    solve_group(first, last, unassigned);
    first = last;
  }
  return column_of_row_;
}

std::uint32_t Assignment::root(std::uint32_t node) {
  while (parent_[node] != node) node = parent_[node] = parent_[parent_[node]];
  return node;
}

void Assignment::group(std::size_t rows, std::size_t columns) {
  parent_.resize(rows + columns);
  std::iota(parent_.begin(), parent_.end(), 0U);
  for (const Candidate& each : candidates_) {
    const std::uint32_t a = root(each.row), b = root(static_cast<std::uint32_t>(rows) + each.column);
    parent_[std::max(a, b)] = std::min(a, b);
  }
  std::sort(candidates_.begin(), candidates_.end(), [this](const Candidate& a, const Candidate& b) {
    return std::tuple(root(a.row), a.cost, a.row, a.column) <
           std::tuple(root(b.row), b.cost, b.row, b.column);
  });
}

void Assignment::solve_group(std::size_t first, std::size_t last, double unassigned) {
  group_rows_.clear();
  group_columns_.clear();
  for (std::size_t k = first; k < last; ++k) {
    group_rows_.push_back(candidates_[k].row);
    group_columns_.push_back(candidates_[k].column);
  }
  sort_unique(group_rows_);
  sort_unique(group_columns_);
  if (group_rows_.size() <= kExact && group_columns_.size() <= kExact) {
    solve_exactly(first, last, unassigned);
  } else {
    solve_greedily(first, last, unassigned);
  }
}

void Assignment::solve_exactly(std::size_t first, std::size_t last, double unassigned) {
  Costs costs;
  costs.rows = group_rows_.size();
  costs.columns = group_columns_.size() + costs.rows;
  for (std::size_t row = 0; row < costs.rows; ++row)
    std::fill_n(&costs.at(row, 0), costs.columns, kImpossible);
  for (std::size_t k = first; k < last; ++k) {
    double& cost =
        costs.at(index_in(group_rows_, candidates_[k].row), index_in(group_columns_, candidates_[k].column));
    cost = std::min(cost, candidates_[k].cost);
  }
  for (std::size_t row = 0; row < costs.rows; ++row) costs.at(row, group_columns_.size() + row) = unassigned;
  const auto row_of = Hungarian(costs).solve();
  for (std::size_t column = 0; column < group_columns_.size(); ++column) {
    if (row_of[column + 1] == 0) continue;
    const std::size_t row = row_of[column + 1] - 1;
    if (costs.at(row, column) < unassigned)
      column_of_row_[group_rows_[row]] = static_cast<std::int32_t>(group_columns_[column]);
  }
}

void Assignment::solve_greedily(std::size_t first, std::size_t last, double unassigned) {
  for (std::size_t k = first; k < last; ++k) {
    const Candidate& each = candidates_[k];
    if (each.cost >= unassigned || column_of_row_[each.row] != kNone || column_taken_[each.column] != 0)
      continue;
    column_of_row_[each.row] = static_cast<std::int32_t>(each.column);
    column_taken_[each.column] = 1;
  }
}

}  // namespace parhelion::people
