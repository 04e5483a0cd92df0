// Quantiles of a sample without interpolation: the result is one of its values, exactly.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <ranges>
#include <utility>

namespace parhelion {

/// Which value of the n in ascending order, x[0] to x[n - 1], is the q quantile. Definitions: Hyndman and
/// Fan, "Sample quantiles in statistical packages", The American Statistician 50 (1996).
enum class QuantileRank {
  lower,  ///< x[floor(q (n - 1))]: the lower of the two values that definition 7 interpolates between
  upper,  ///< x[floor(q n)]: definition 1, but where q n is whole, the upper of the two values that
          ///< definition 2 takes the mean of; at most x[n - 1]
};

/// The q quantile, q from 0 to 1, of at least one value. Changes the order of `values`. O(n).
template <std::ranges::random_access_range Values>
std::ranges::range_value_t<Values> quantile(Values&& values, double q,
                                            QuantileRank rank = QuantileRank::lower) {
  const auto count = static_cast<std::size_t>(std::ranges::size(values));
  assert(count > 0);
  const auto span = static_cast<double>(rank == QuantileRank::lower ? count - 1 : count);
  const std::size_t index = std::min(static_cast<std::size_t>(q * span), count - 1);
  const auto at = std::ranges::begin(values) + static_cast<std::ptrdiff_t>(index);
  std::nth_element(std::ranges::begin(values), at, std::ranges::end(values));
  return *at;
}

/// The `low` and the `high` quantile by QuantileRank::lower, 0 <= low <= high <= 1, of at least one value.
/// Changes the order of `values`. O(n).
template <std::ranges::random_access_range Values>
std::pair<std::ranges::range_value_t<Values>, std::ranges::range_value_t<Values>> quantile_range(
    Values&& values, double low, double high) {
  const auto count = static_cast<std::size_t>(std::ranges::size(values));
  const auto last = quantile(values, high);
  // Those up to it are the smallest now.
  const auto at = [&](double q) { return static_cast<std::size_t>(q * static_cast<double>(count - 1)); };
  const auto first = std::ranges::begin(values) + static_cast<std::ptrdiff_t>(at(low));
  const auto end = std::ranges::begin(values) + static_cast<std::ptrdiff_t>(at(high));
  if (first == end) return {last, last};
  std::nth_element(std::ranges::begin(values), first, end);
  return {*first, last};
}

/// The median; of an even number of values the upper of the two. Changes the order of `values`.
template <std::ranges::random_access_range Values>
std::ranges::range_value_t<Values> median(Values&& values) {
  return quantile(values, 0.5, QuantileRank::upper);
}

}  // namespace parhelion
