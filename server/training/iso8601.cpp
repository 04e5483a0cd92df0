#include "server/training/iso8601.hpp"

#include <array>
#include <chrono>
#include <cstdio>
#include <iterator>
#include <string_view>

namespace parhelion::training {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kDay = 86'400 * kSecond;

/// Consumes text from the front.
class TextFront {
 public:
  explicit TextFront(std::string_view text) : text_(text) {}
  bool at_end() const { return text_.empty(); }
  bool take(char letter) {
    if (text_.empty() || text_.front() != letter) return false;
    text_.remove_prefix(1);
    return true;
  }
  /// `min_count` to `max_count` digits; -1: too few.
  std::int64_t digits(std::size_t min_count, std::size_t max_count) {
    std::int64_t number = 0;
    std::size_t count = 0;
    for (; count < max_count && !text_.empty() && text_.front() >= '0' && text_.front() <= '9'; ++count) {
      number = 10 * number + (text_.front() - '0');
      text_.remove_prefix(1);
    }
    return count < min_count ? -1 : number;
  }
  /// Digits after a decimal point, as ns of a second, rounded down. -1: none.
  std::int64_t decimals() {
    std::int64_t ns = 0, unit = kSecond;
    bool any = false;
    while (!text_.empty() && text_.front() >= '0' && text_.front() <= '9') {
      unit /= 10;
      ns += unit * (text_.front() - '0');
      text_.remove_prefix(1);
      any = true;
    }
    return any ? ns : -1;
  }

 private:
  std::string_view text_;
};

/// ns east of UTC.
std::optional<std::int64_t> offset_of(TextFront& front) {
  if (front.take('Z') || front.take('z')) return 0;
  const bool west = front.take('-');
  if (!west && !front.take('+')) return std::nullopt;
  const std::int64_t hours = front.digits(2, 2);
  const bool colon = front.take(':');
  const std::int64_t minutes = front.at_end() && !colon ? 0 : front.digits(2, 2);
  if (hours < 0 || hours > 23 || minutes < 0 || minutes > 59) return std::nullopt;
  return (west ? -1 : 1) * (hours * 60 + minutes) * 60 * kSecond;
}

}  // namespace

std::string timestamp_text(SimulationTime stamp) {
  namespace chrono = std::chrono;
  const std::int64_t day = stamp.ns >= 0 ? stamp.ns / kDay : -((-stamp.ns + kDay - 1) / kDay);
  const std::int64_t rest = stamp.ns - day * kDay;
  const chrono::year_month_day date{chrono::sys_days(chrono::days(day))};
  char text[48];
  std::snprintf(text, sizeof text, "%04d-%02u-%02uT%02d:%02d:%02d.%09dZ", static_cast<int>(date.year()),
                static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                static_cast<int>(rest / kSecond / 3600), static_cast<int>(rest / kSecond / 60 % 60),
                static_cast<int>(rest / kSecond % 60), static_cast<int>(rest % kSecond));
  return text;
}

std::optional<SimulationTime> timestamp_of(const std::string& text) {
  namespace chrono = std::chrono;
  TextFront front(text);
  const std::int64_t year = front.digits(4, 4);
  if (!front.take('-')) return std::nullopt;
  const std::int64_t month = front.digits(2, 2);
  if (!front.take('-')) return std::nullopt;
  const std::int64_t day = front.digits(2, 2);
  if (!front.take('T') && !front.take('t') && !front.take(' ')) return std::nullopt;
  std::array<std::int64_t, 3> clock{};
  for (std::size_t i = 0; i < clock.size(); ++i) {
    if (i > 0 && !front.take(':')) return std::nullopt;
    clock[i] = front.digits(2, 2);
  }
  const std::int64_t fraction = front.take('.') ? front.decimals() : 0;
  const auto offset = offset_of(front);
  const chrono::year_month_day date{chrono::year(static_cast<int>(year)),
                                    chrono::month(static_cast<unsigned>(month)),
                                    chrono::day(static_cast<unsigned>(day))};
  if (!front.at_end() || !offset || fraction < 0 || year < 1970 || year > 2200 || month < 1 || day < 1 ||
      !date.ok() || clock[0] < 0 || clock[0] > 23 || clock[1] < 0 || clock[1] > 59 || clock[2] < 0 ||
      clock[2] > 60)
    return std::nullopt;
  const std::int64_t days = chrono::sys_days(date).time_since_epoch().count();
  return SimulationTime{days * kDay + (clock[0] * 3600 + clock[1] * 60 + clock[2]) * kSecond + fraction -
                        *offset};
}

std::string duration_text(Duration duration) {
  char text[48];
  std::snprintf(text, sizeof text, "PT%lld.%09lldS", static_cast<long long>(duration.ns / kSecond),
                static_cast<long long>(duration.ns % kSecond));
  return text;
}

std::optional<Duration> duration_of(const std::string& text) {
  struct Unit {
    char letter;
    bool clock;
    std::int64_t ns;
  };
  static constexpr Unit kUnits[] = {{'W', false, 7 * kDay},
                                    {'D', false, kDay},
                                    {'H', true, 3600 * kSecond},
                                    {'M', true, 60 * kSecond},
                                    {'S', true, kSecond}};
  TextFront front(text);
  if (!front.take('P')) return std::nullopt;
  std::int64_t ns = 0;
  bool clock = false, any = false;
  std::size_t unit = 0;
  while (!front.at_end()) {
    if (!clock && front.take('T')) clock = true;
    const std::int64_t whole = front.digits(1, 10);
    const std::int64_t fraction = front.take('.') || front.take(',') ? front.decimals() : 0;
    if (whole < 0 || fraction < 0) return std::nullopt;
    while (unit < std::size(kUnits) && (kUnits[unit].clock != clock || !front.take(kUnits[unit].letter)))
      ++unit;
    if (unit == std::size(kUnits)) return std::nullopt;
    constexpr std::int64_t kMaxDuration = 200 * 366 * kDay;
    if (whole > (kMaxDuration - ns) / kUnits[unit].ns) return std::nullopt;
    ns += whole * kUnits[unit].ns + fraction * (kUnits[unit].ns / kSecond);
    ++unit;
    any = true;
  }
  if (!any) return std::nullopt;
  return Duration{ns};
}

}  // namespace parhelion::training
