#include "tools/channel_statistics.hpp"

#include <algorithm>
#include <cmath>

#include "protocols/codec.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::tools {
namespace {

std::vector<std::int64_t> differences(const std::vector<std::int64_t>& times) {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  return steps;
}

}  // namespace

std::optional<std::int64_t> utime_of(Bytes payload) {
  if (payload.size() < 16 || !type_name(payload).ends_with("_t")) return std::nullopt;
  std::uint64_t value = 0;
  for (std::size_t i = 8; i < 16; ++i) value = value << 8 | payload[i];  // after the fingerprint
  return static_cast<std::int64_t>(value);
}

void ChannelStatistics::add(const Message& message) {
  ++count_;
  bytes_ += message.payload.size();
  const std::string type = type_name(message.payload);
  type_ = count_ == 1 || type == type_ ? type : "mixed";
  arrivals_.push_back(message.arrival.utime());
  if (const auto utime = utime_of(message.payload)) stamps_.push_back(*utime);
}

double ChannelStatistics::rate() const {
  if (count_ < 2 || arrivals_.back() <= arrivals_.front()) return 0;
  return static_cast<double>(count_ - 1) * 1e6 / static_cast<double>(arrivals_.back() - arrivals_.front());
}

double ChannelStatistics::jitter() const {
  const auto steps = differences(arrivals_);
  if (steps.empty()) return 0;
  double sum = 0, squares = 0;
  for (const std::int64_t step : steps) sum += static_cast<double>(step);
  const double mean = sum / static_cast<double>(steps.size());
  for (const std::int64_t step : steps)
    squares += (static_cast<double>(step) - mean) * (static_cast<double>(step) - mean);
  return std::sqrt(squares / static_cast<double>(steps.size())) * 1e-6;
}

double ChannelStatistics::shortest() const {
  const auto steps = differences(arrivals_);
  return steps.empty() ? 0 : static_cast<double>(*std::min_element(steps.begin(), steps.end())) * 1e-6;
}

double ChannelStatistics::longest() const {
  const auto steps = differences(arrivals_);
  return steps.empty() ? 0 : static_cast<double>(*std::max_element(steps.begin(), steps.end())) * 1e-6;
}

std::uint64_t ChannelStatistics::lost() const {
  auto steps = differences(stamps_.size() == count_ ? stamps_ : arrivals_);
  if (steps.size() < 2) return 0;
  const std::int64_t usual = median(steps);
  if (usual <= 0) return 0;
  std::uint64_t lost = 0;
  for (const std::int64_t step : steps) {
    const double periods = std::round(static_cast<double>(step) / static_cast<double>(usual));
    if (periods >= 2) lost += static_cast<std::uint64_t>(periods) - 1;
  }
  return lost;
}

}  // namespace parhelion::tools
