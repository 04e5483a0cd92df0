#include "tools/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

namespace parhelion::tools {
namespace {

double rounded(double value) { return std::round(value * 10) / 10; }

std::string duration_text(double seconds) {
  char text[32];
  const long s = std::lround(seconds);
  if (s < 90) {
    std::snprintf(text, sizeof text, "%ld s", s);
  } else {
    std::snprintf(text, sizeof text, "%ld:%02ld min", s / 60, s % 60);
  }
  return text;
}

}  // namespace

std::string progress_line(std::string_view task, double done, double total, std::string_view unit,
                          double elapsed, bool terminal) {
  const bool known = total > 0 && done > 0;
  const double left = known ? elapsed * std::max(0.0, total - done) / done : 0;
  if (!terminal) {
    nlohmann::ordered_json line = {{"task", task}, {"done", rounded(done)}};
    if (total > 0) line["total"] = rounded(total);
    line["unit"] = unit;
    line["elapsed_s"] = rounded(elapsed);
    if (known) line["left_s"] = rounded(left);
    // A file name in the task may be invalid UTF-8.
    return line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  }
  char text[160];
  const std::string name(task), unit_name(unit);
  if (!known) {
    std::snprintf(text, sizeof text, "%s  %.1f %s", name.c_str(), done, unit_name.c_str());
    return text;
  }
  std::snprintf(text, sizeof text, "%s  %3.0f %%  %.1f of %.1f %s  %s left", name.c_str(), 100 * done / total,
                done, total, unit_name.c_str(), duration_text(left).c_str());
  return text;
}

Progress::Progress(std::string task, std::string unit, std::FILE* stream)
    : task_(std::move(task)),
      unit_(std::move(unit)),
      stream_(stream),
      terminal_(stream != nullptr && isatty(fileno(stream)) == 1),
      start_(Clock::now()),
      next_(start_ + std::chrono::seconds(1)) {}

Progress::~Progress() { finish(); }

void Progress::update(double done, double total) {
  if (stream_ == nullptr) return;
  const auto now = Clock::now();
  if (now < next_) return;
  next_ = now + std::chrono::milliseconds(terminal_ ? 200 : 1000);
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const std::string line = progress_line(task_, done, total, unit_, elapsed, terminal_);
  // "\033[K" clears the rest of a longer line.
  std::fprintf(stream_, terminal_ ? "\r%s\033[K" : "%s\n", line.c_str());
  std::fflush(stream_);
  line_open_ = terminal_;
}

void Progress::finish() {
  if (line_open_) std::fputc('\n', stream_);
  line_open_ = false;
}

}  // namespace parhelion::tools
