#include "fusion/people/assignment.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <numeric>

namespace parhelion::people {
namespace {

double cost_of(std::span<const std::int32_t> columns, const std::vector<Candidate>& candidates,
               double unassigned) {
  double sum = 0;
  for (std::size_t row = 0; row < columns.size(); ++row) {
    double cost = unassigned;
    for (const Candidate& each : candidates)
      if (each.row == row && columns[row] == static_cast<std::int32_t>(each.column))
        cost = std::min(cost, each.cost);
    sum += cost;
  }
  return sum;
}

double min_cost(std::size_t row, std::size_t rows, const std::vector<Candidate>& candidates,
                double unassigned, std::vector<char>& taken) {
  if (row == rows) return 0;
  double best = unassigned + min_cost(row + 1, rows, candidates, unassigned, taken);
  for (const Candidate& each : candidates) {
    if (each.row != row || taken[each.column] != 0) continue;
    taken[each.column] = 1;
    best = std::min(best, each.cost + min_cost(row + 1, rows, candidates, unassigned, taken));
    taken[each.column] = 0;
  }
  return best;
}

RC_GTEST_PROP(Assignment, has_the_least_cost_of_all_assignments, ()) {
  const auto rows = *rc::gen::inRange<std::size_t>(1, 6), columns = *rc::gen::inRange<std::size_t>(1, 6);
  std::vector<Candidate> candidates;
  for (std::uint32_t r = 0; r < rows; ++r)
    for (std::uint32_t c = 0; c < columns; ++c)
      if (*rc::gen::inRange(0, 3) > 0) candidates.push_back({r, c, *rc::gen::inRange(0, 100) / 10.0});
  Assignment assignment;
  const auto result = assignment.solve(rows, columns, candidates, 6);
  std::vector<int> uses(columns, 0);
  for (const std::int32_t column : result)
    if (column != Assignment::kNone) RC_ASSERT(++uses[static_cast<std::size_t>(column)] == 1);
  std::vector<char> taken(columns, 0);
  RC_ASSERT(std::abs(cost_of(result, candidates, 6) - min_cost(0, rows, candidates, 6, taken)) < 1e-9);
}

TEST(Assignment, gives_no_column_twice_where_hundreds_compete) {
  std::vector<Candidate> candidates;
  for (std::uint32_t r = 0; r < 300; ++r)
    for (std::uint32_t c = 0; c < 200; ++c) candidates.push_back({r, c, 0.01 * ((r * 7 + c * 13) % 500)});
  Assignment assignment;
  const auto result = assignment.solve(300, 200, candidates, 9);
  std::vector<int> uses(200, 0);
  std::size_t assigned = 0;
  for (const std::int32_t column : result) {
    if (column == Assignment::kNone) continue;
    ++assigned;
    EXPECT_EQ(++uses[static_cast<std::size_t>(column)], 1);
  }
  EXPECT_EQ(assigned, 200U);
}

}  // namespace
}  // namespace parhelion::people
